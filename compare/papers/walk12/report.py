"""Report of the reproduced 12-joint walk: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib import resources
from typing import Any, get_args

import numpy as np

from compare.judge import DENSE_INTERVALS
from compare.papers.paper_runs import best, objectives
from compare.papers.walk12.walk12_errata import corner_slopes, hip_miss
from compare.papers.walk12.walk12_figures import all_figures
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3, TABLE_4, row_of
from compare.papers.walk12.walk12_runs import (
    CORNER_M,
    GA_EVALUATIONS,
    HORIZONS,
    MODEL,
    MOMENT_FREE_WEIGHTS,
    PAPER,
    Effort,
    f1_of_gait,
)
from compare.papers.walk12.walk12_tables import SAME_OPTIMUM, Findings, all_tables, dense, f_of_runs
from compare.report.document import Document
from compare.report.template import fill_template
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.formulation import load
from nlp_gait.gaits.walk12.model import Zmp
from nlp_gait.gaits.walk12.robot import point_mass_biped

PRINTED_DIGIT = 5e-5  # a difference below this is rounding
PLATEAU_M = 1e-4  # a step length this close to its bound is on a plateau


def document(findings: Findings, effort: Effort) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.walk12") / "walk12_report.md").read_text(encoding="utf-8")
    values = {
        "ga_evaluations": GA_EVALUATIONS,
        "pso_evaluations": effort.pso_evaluations,
        "runs": effort.runs,
        "starts": effort.starts,
        **_settings(),
        **_normalisation(findings),
        **_tradeoff(findings),
        **_errata(findings),
    }
    return fill_template(text, values=values, tables=all_tables(findings), figures=all_figures(findings))


def _settings() -> dict[str, Any]:
    """Numbers of the problem and of the robot that the text names."""
    problem, robot = load("walk12"), point_mass_biped()
    lengths = _step_lengths()
    return {
        "f1max": F1MAX,
        "f2max": F2MAX,
        "knee_rad": problem.value("reach_margin_rad"),
        "agree": SAME_OPTIMUM,
        "intervals": problem.options["intervals"],
        "dense_intervals": DENSE_INTERVALS,
        "s_bounds": lengths,
        "longest_mm": 1e3 * lengths[1],
        "stable_step_s": TABLE_3[-1].step_time_s,
        "hip_speed": lengths[1] / 2 / TABLE_3[-1].step_time_s,
        "hip_aside_mm": 1e3 * robot.hip_distance_m / 2,
        "sole_reach_mm": 1e3 * robot.foot_width_m / 2,
        "branch_m": math.sqrt(abs(robot.thigh_m**2 - robot.shank_m**2)),
        "corner_m": CORNER_M,
        "corner_leg_mm": 1e3 * (robot.leg_m - 2 * CORNER_M),
        "free_weights": MOMENT_FREE_WEIGHTS,
    }


def _step_lengths() -> tuple[float, float]:
    """Bounds of the step length [m]."""
    problem = load("walk12")
    return problem.value("step_length_m.lower"), problem.value("step_length_m.upper")


def _trend(values: Iterable[float]) -> str:
    """How f1 goes through the rows of Table IV, whose steps get shorter."""
    changes = np.diff(list(values))
    if (changes > 0).all():
        return "rises throughout"
    return "falls throughout" if (changes < 0).all() else "rises and falls"


def _normalisation(findings: Findings) -> dict[str, Any]:
    ga = f_of_runs(findings.of(PAPER, 1.0, "ga"))
    optima = zip(TABLE_3, objectives(_optima(findings, MODEL)), strict=True)
    gaps = {row.weight: row.f - f for row, f in optima}
    leads = {
        f"lead_{label}": _range(
            dense(optimum)["f"] - f
            for optimum, f in zip(_optima(findings, label), findings.f_of_papers_gaits(label), strict=True)
        )
        for label in (PAPER, MODEL)
    }
    return {
        **leads,
        "own_f1max": findings.own_f1max,
        "dense_f1max": dense(findings.optimum(PAPER, 1.0))["f1_per_m2s"],
        "ga_f1": (min(ga) * F1MAX, max(ga) * F1MAX),
        "printed_above": ", ".join(f"{w:g} (by {gap:.4f})" for w, gap in gaps.items() if gap > PRINTED_DIGIT),
    }


def _optima(findings: Findings, label: str) -> list[RunRecord]:
    return [findings.optimum(label, row.weight) for row in TABLE_3]


def _tradeoff(findings: Findings) -> dict[str, Any]:
    weighted, (shortest, longest) = findings.weighted, _step_lengths()
    s, Q = np.array([(at.step_length_m, at.Q_m2s) for at in findings.front]).T
    rise = (1 / Q[:-1] - 1 / Q[-1]) / (s[-1] - s[:-1])  # of f1, from the longest step to each shorter one
    return {
        "plateaus": (
            max(at.at for at in weighted if at.step_length_m > longest - PLATEAU_M),
            min(at.at for at in weighted if at.step_length_m < shortest + PLATEAU_M),
        ),
        "tangent_mm": 1e3 * s[int(np.argmax(rise))],
        "sweep_iterations": int(np.median([at.iterations for at in weighted])),
    }


def _errata(findings: Findings) -> dict[str, Any]:
    exact = np.array(findings.f1_of_table_3)
    changes = {
        zmp: _range(100 * (np.array([f1_of_gait(row, zmp=zmp) for row in TABLE_3]) / exact - 1))
        for zmp in get_args(Zmp)
    }
    (corner,) = findings.runs["corner", IPOPT]
    free = [best(findings.runs[f"moment-free-{weight:g}", IPOPT]) for weight in MOMENT_FREE_WEIGHTS]
    return {
        "f1_change": {zmp: f"{low:+z.2f} % to {high:+z.2f} %" for zmp, (low, high) in changes.items()},
        "free": objectives(free),
        "hip_miss_mm": 1e3 * hip_miss(),
        "corner_slopes": corner_slopes(),
        "corner_f": corner.verdict.objective,
        "lateral_jump": math.pi * row_of(0.15).x[1],
        "stable": findings.stable[-1],
        "trend": {
            "implied": _trend([row.implied_f1 for row in TABLE_4]),
            **{horizon: _trend([f1_of_gait(row, horizon=horizon) for row in TABLE_4]) for horizon in HORIZONS},
        },
        "horizon_gap": _range(100 * abs(f1_of_gait(row, horizon="1s") / row.implied_f1 - 1) for row in TABLE_4),
    }


def _range(values: Iterable[float]) -> tuple[float, float]:
    known = [float(value) for value in values]
    return min(known), max(known)
