"""Bhardwaj, Mishra, Sukavanam, Balasubramanian, reproduced: Tables III and IV, Figs. 3, 6 to 29, next to IPOPT and searches."""

from __future__ import annotations

import math
from typing import Any

from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction
from compare.papers.stairs import stairs_replay, stairs_runs
from compare.papers.stairs.stairs_figures import draw_figures
from compare.papers.stairs.stairs_paper import TABLE_3
from compare.papers.stairs.stairs_replay import FEEDBACK, STEP_S
from compare.papers.stairs.stairs_runs import (
    ALGORITHMS,
    LOST_RAD,
    RULES,
    StairsEffort,
    make_computations,
    make_first_tasks,
    make_track_spec,
    make_track_tasks,
)
from compare.papers.stairs.stairs_tables import StairsFindings, make_tables
from compare.study.task import IPOPT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.stair import GOVERNING_VARIABLES, PAPER_TIMES

NEAR_BOUND = 0.01  # of a gain's range


def run_stairs(runner: Runner, effort: StairsEffort) -> StairsFindings:
    """Run plans and ideals, then track the best plans, then compute what follows from them."""
    runs = runner.run_tasks(make_first_tasks(effort))
    runs |= runner.run_tasks(make_track_tasks(effort, runs))
    steps = runner.compute(make_computations(effort, runs), code=(stairs_runs, stairs_replay))
    return StairsFindings(effort=effort, runs=runs, steps=steps)


def compute_values(findings: StairsFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    effort = findings.effort
    (end_rate,) = [variable for variable in GOVERNING_VARIABLES if variable.name == "end_rate_rad_s"]
    return {
        "plan_evaluations": effort.plan_evaluations,
        "track_evaluations": effort.track_evaluations,
        "network_case": effort.cases[0],
        "cases": " | ".join(f"case {case}" for case in effort.cases),
        "papers": " | ".join(f"paper {case}" for case in effort.cases),
        "ours": " | ".join(f"ours {case}" for case in effort.cases),
        "cases_4f": " | ".join(".4f" for _ in effort.cases),
        "cases_6g": " | ".join(".6g" for _ in effort.cases),
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
        **_count_gains_at_bounds(findings),
        **_compute_growth(findings),
    }


def _count_gains_at_bounds(findings: StairsFindings) -> dict[str, Any]:
    """How many of the best runs on the track end at the upper bounds of both gains."""
    tracks = [(case, findings.best("track", case, name)) for case in findings.cases for name in (*ALGORITHMS, IPOPT)]
    at_bounds = 0
    for case, run in tracks:
        problem = make_track_spec(case, findings.plan(case)).load()
        share = (problem.upper - [run.x[name] for name in problem.names]) / (problem.upper - problem.lower)
        at_bounds += all(share[problem.variable_index(gain)] <= NEAR_BOUND for gain in ("kp", "kd"))
    return {"at_bounds": at_bounds, "best_tracks": len(tracks), "near_bound": NEAR_BOUND}


def _compute_growth(findings: StairsFindings) -> dict[str, Any]:
    """How fast the open-loop error grows in the replay, and when the pose is lost."""
    replays = [findings.steps[f"replay-{case}"] for case in findings.cases]
    tenths = 10 * (PAPER_TIMES[1] - PAPER_TIMES[0])
    factors = [(replay["open_loop_t2_rad"] / replay["open_loop_t1_rad"]) ** (1 / tenths) for replay in replays]
    lost = [replay["open_loop_lost_s"] - PAPER_TIMES[1] for replay in replays if replay["open_loop_lost_s"] is not None]
    when = f"{min(lost):.2f} to {max(lost):.2f} s after t2" if lost else "never"
    return {
        "growth": f"{min(factors):.1f} to {max(factors):.1f}",
        "lost": f"{when} ({len(lost)} of {len(replays)} cases)",
    }


REPRODUCTION = Reproduction(
    template="stairs/stairs_report.md",
    full=StairsEffort(),
    quick=StairsEffort(
        cases=(2,),  # the one that the paper draws where it draws one only
        plan_starts=1,
        jerk_starts=1,
        hip_starts=1,
        ideal_starts=1,
        runs=2,
        plan_evaluations=200,
        track_evaluations=60,
        track_settings={"iterations": 1, "hessian": "limited-memory"},
        other_stairs=((0.30, 0.10),),
        other_starts=1,
        poses=3,
        plan_intervals=16,
        ideal_intervals=14,
    ),
    run=run_stairs,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
)
