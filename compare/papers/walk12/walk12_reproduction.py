"""Goswami, Vadakkepat, Phung (2008), reproduced: Tables III and IV, Figs. 8 to 10 and 12 to 17, the trade-off, a circle."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, get_args

import numpy as np

from compare.judge import DENSE_INTERVALS
from compare.papers.paper_runs import Runner, choose_best, compute_range, get_point, list_objectives
from compare.papers.reproduction import Reproduction
from compare.papers.walk12 import walk12_runs
from compare.papers.walk12.walk12_errata import compute_corner_slopes, compute_hip_miss
from compare.papers.walk12.walk12_figures import TURN_RAD, TURNING_WEIGHT, draw_figures
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3, TABLE_4, find_row
from compare.papers.walk12.walk12_runs import (
    CORNER_M,
    GA_EVALUATIONS,
    HORIZONS,
    MODEL,
    MOMENT_FREE_WEIGHTS,
    PAPER,
    PathPoint,
    Walk12Effort,
    compute_f1,
    make_first_tasks,
    make_paths,
    make_second_tasks,
)
from compare.papers.walk12.walk12_tables import SAME_OPTIMUM, Walk12Findings, get_dense, list_f, make_tables
from compare.report.document import Table
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.formulation import load
from nlp_gait.gaits.walk12.locomotion import JOINTS, locomotion
from nlp_gait.gaits.walk12.model import Zmp
from nlp_gait.gaits.walk12.robot import point_mass_biped

PRINTED_DIGIT = 5e-5  # a difference below this is rounding
PLATEAU_M = 1e-4  # a step length this close to its bound is on a plateau


def run_walk12(runner: Runner, effort: Walk12Effort) -> Walk12Findings:
    """Run Table III under both normalisations, Table IV, the errata and both paths."""
    runs = runner.run_tasks(make_first_tasks(effort))
    runs |= runner.run_tasks(make_second_tasks(effort, runs))
    paths = runner.compute(make_paths(effort), code=(walk12_runs,))
    weighted, front = ([PathPoint(**row) for row in rows] for rows in paths.values())
    return Walk12Findings(effort=effort, runs=runs, weighted=weighted, front=front)


def make_trajectories(findings: Walk12Findings) -> list[Table]:
    """Return two steps of IPOPT's gaits, straight ahead and on a circle."""
    header = ["t_s", *(f"{joint}_rad" for joint in JOINTS), "zmp_x_m", "zmp_y_m", "left_stance"]
    tables = []
    for name, weight, turn_rad in (("walk-straight", 0.15, 0.0), ("walk-circle", TURNING_WEIGHT, TURN_RAD)):
        x = np.array(get_point(findings.optimum(PAPER, weight)))
        arrays = locomotion(point_mass_biped(), x, intervals=50, turn_rad=turn_rad).arrays
        rows = np.column_stack([arrays[signal] for signal in ("t", "q", "zmp", "left_stance")]).tolist()
        tables.append(Table(name=name, columns=dict.fromkeys(header, ""), rows=rows))
    return tables


def compute_values(findings: Walk12Findings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    return {**_settings(findings), **_normalisation(findings), **_tradeoff(findings), **_errata(findings)}


def _settings(findings: Walk12Findings) -> dict[str, Any]:
    problem, robot, effort = load("walk12"), point_mass_biped(), findings.effort
    lengths = _step_lengths()
    return {
        "ga_evaluations": GA_EVALUATIONS,
        "pso_evaluations": effort.pso_evaluations,
        "runs": effort.runs,
        "starts": effort.starts,
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


def _normalisation(findings: Walk12Findings) -> dict[str, Any]:
    ga = list_f(findings.records(PAPER, 1.0, "ga"))
    optima = zip(TABLE_3, list_objectives(_optima(findings, MODEL)), strict=True)
    gaps = {row.weight: row.f - f for row, f in optima}
    leads = {
        f"lead_{label}": compute_range(
            get_dense(optimum)["f"] - f
            for optimum, f in zip(_optima(findings, label), findings.f_of_printed_gaits(label), strict=True)
        )
        for label in (PAPER, MODEL)
    }
    return {
        **leads,
        "own_f1max": findings.own_f1max,
        "dense_f1max": get_dense(findings.optimum(PAPER, 1.0))["f1_per_m2s"],
        "ga_f1": (min(ga) * F1MAX, max(ga) * F1MAX),
        "printed_above": ", ".join(f"{w:g} (by {gap:.4f})" for w, gap in gaps.items() if gap > PRINTED_DIGIT),
    }


def _optima(findings: Walk12Findings, label: str) -> list[RunRecord]:
    return [findings.optimum(label, row.weight) for row in TABLE_3]


def _tradeoff(findings: Walk12Findings) -> dict[str, Any]:
    weighted, (shortest, longest) = findings.weighted, _step_lengths()
    s, Q = np.array([(point.step_length_m, point.Q_m2s) for point in findings.front]).T
    rise = (1 / Q[:-1] - 1 / Q[-1]) / (s[-1] - s[:-1])  # of f1, from the longest step to each shorter one
    return {
        "plateaus": (
            max(point.at for point in weighted if point.step_length_m > longest - PLATEAU_M),
            min(point.at for point in weighted if point.step_length_m < shortest + PLATEAU_M),
        ),
        "tangent_mm": 1e3 * s[int(np.argmax(rise))],
        "sweep_iterations": int(np.median([point.iterations for point in weighted])),
    }


def _errata(findings: Walk12Findings) -> dict[str, Any]:
    exact = np.array(findings.f1_of_table_3)
    changes = {
        zmp: compute_range(100 * (np.array([compute_f1(row, zmp=zmp) for row in TABLE_3]) / exact - 1))
        for zmp in get_args(Zmp)
    }
    (corner,) = findings.runs["corner", IPOPT]
    free = [choose_best(findings.runs[f"moment-free-{weight:g}", IPOPT]) for weight in MOMENT_FREE_WEIGHTS]
    f1 = {horizon: [compute_f1(row, horizon=horizon) for row in TABLE_4] for horizon in HORIZONS}
    implied = [row.implied_f1 for row in TABLE_4]
    return {
        "f1_change": {zmp: f"{low:+z.2f} % to {high:+z.2f} %" for zmp, (low, high) in changes.items()},
        "free": list_objectives(free),
        "hip_miss_mm": 1e3 * compute_hip_miss(),
        "corner_slopes": compute_corner_slopes(),
        "corner_f": corner.verdict.objective,
        "lateral_jump": math.pi * find_row(0.15).x[1],
        "stable": findings.stable[-1],
        "trend": {"implied": _trend(implied), **{horizon: _trend(values) for horizon, values in f1.items()}},
        "horizon_gap": compute_range(100 * abs(f / wanted - 1) for f, wanted in zip(f1["1s"], implied, strict=True)),
    }


def _trend(values: Iterable[float]) -> str:
    """How f1 changes along the rows of Table IV, whose steps get shorter."""
    changes = np.diff(list(values))
    if (changes > 0).all():
        return "rises throughout"
    return "falls throughout" if (changes < 0).all() else "rises and falls"


REPRODUCTION = Reproduction(
    template="walk12/walk12_report.md",
    full=Walk12Effort(),
    quick=Walk12Effort(starts=2, runs=2, pso_evaluations=500, weights=(0.2, 0.7, 1.0), lengths_m=(0.05, 0.09, 0.13)),
    run=run_walk12,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    csv_tables=make_trajectories,
)
