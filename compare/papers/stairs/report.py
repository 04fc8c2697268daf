"""Report of the reproduced stairs paper: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

from compare.papers.stairs.stairs_figures import all_figures
from compare.papers.stairs.stairs_paper import TABLE_3
from compare.papers.stairs.stairs_replay import FEEDBACK, STEP_S
from compare.papers.stairs.stairs_runs import ALGORITHMS, LOST_RAD, RULES, Effort, track_spec
from compare.papers.stairs.stairs_tables import Findings, all_tables
from compare.report.document import Document
from compare.report.template import fill_template
from compare.study.task import IPOPT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.stair import GOVERNING_VARIABLES, PAPER_TIMES

NEAR_BOUND = 0.01  # of a gain's range


def document(findings: Findings) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.stairs") / "stairs_report.md").read_text(encoding="utf-8")
    effort = findings.effort
    values = {
        "plan_evaluations": effort.plan_evaluations,
        "track_evaluations": effort.track_evaluations,
        "network_case": effort.cases[0],
        "cases": " | ".join(f"case {case}" for case in effort.cases),
        "papers": " | ".join(f"paper {case}" for case in effort.cases),
        "ours": " | ".join(f"ours {case}" for case in effort.cases),
        "cases_4f": " | ".join(".4f" for _ in effort.cases),
        "cases_6g": " | ".join(".6g" for _ in effort.cases),
        **_settings(effort),
        **_gains(findings),
        **_growth(findings),
    }
    return fill_template(text, values=values, tables=all_tables(findings), figures=all_figures(findings))


def _settings(effort: Effort) -> dict[str, Any]:
    (end_rate,) = [variable for variable in GOVERNING_VARIABLES if variable.name == "end_rate_rad_s"]
    return {
        "hip_height_m": TABLE_3["hip_height_m"],
        "hip_starts": effort.hip_starts,
        "quantum_s": QUANTUM,
        "step_ms": 1e3 * STEP_S,
        "feedback_rad_s": math.sqrt(FEEDBACK[0]),
        "lost_rad": LOST_RAD,
        "t1_s": PAPER_TIMES[0],
        "t2_s": PAPER_TIMES[1],
        "tolerance_m2": RULES["adam"].tolerance_m2,
        "adam_rate": RULES["adam"].rate,
        "end_rate": (end_rate.lower, end_rate.upper),
    }


def _gains(findings: Findings) -> dict[str, Any]:
    """How many of the best runs on the track end at the upper bounds of both gains."""
    found = [(case, findings.best("track", case, name)) for case in findings.cases for name in (*ALGORITHMS, IPOPT)]
    at_bounds = 0
    for case, run in found:
        problem = track_spec(case, findings.plan(case)).load()
        share = (problem.upper - [run.x[name] for name in problem.names]) / (problem.upper - problem.lower)
        at_bounds += all(share[problem.variable_index(gain)] <= NEAR_BOUND for gain in ("kp", "kd"))
    return {"at_bounds": at_bounds, "best_tracks": len(found), "near_bound": NEAR_BOUND}


def _growth(findings: Findings) -> dict[str, Any]:
    """How fast the open-loop error grows in the replay, and when the pose is lost."""
    steps = [findings.steps[f"replay-{case}"] for case in findings.cases]
    tenths = 10 * (PAPER_TIMES[1] - PAPER_TIMES[0])
    factors = [(step["open_loop_t2_rad"] / step["open_loop_t1_rad"]) ** (1 / tenths) for step in steps]
    lost = [step["open_loop_lost_s"] - PAPER_TIMES[1] for step in steps if step["open_loop_lost_s"] is not None]
    when = f"{min(lost):.2f} to {max(lost):.2f} s after t2" if lost else "never"
    return {
        "growth": f"{min(factors):.1f} to {max(factors):.1f}",
        "lost": f"{when} ({len(lost)} of {len(steps)} cases)",
    }
