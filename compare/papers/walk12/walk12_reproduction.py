"""Goswami, Vadakkepat, Phung (2008), reproduced: Tables III and IV, Figs. 8 to 10 and 12 to 17, the trade-off, a circle."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any, get_args

import numpy as np

from compare.analysis.units import join_words
from compare.judge import DENSE_INTERVALS
from compare.papers.claims import bind_checks
from compare.papers.paper_runs import Runner, choose_best, compute_range, get_point, list_objectives
from compare.papers.reproduction import Reproduction
from compare.papers.walk12 import walk12_claims, walk12_paper
from compare.papers.walk12 import walk12_runs as runs
from compare.papers.walk12.walk12_claims import list_f1max
from compare.papers.walk12.walk12_figures import TURN_RAD, TURNING_WEIGHT, draw_figures
from compare.papers.walk12.walk12_findings import Walk12Findings, compute_knees, follow, list_f, list_rounded
from compare.papers.walk12.walk12_paper import CHANGES, F1MAX, F2MAX, SHARES, TABLE_3, TABLE_4, PaperRow, find_row
from compare.papers.walk12.walk12_runs import CORNER_M, HORIZONS, MODEL, PAPER, PathPoint, Walk12Effort, compute_f1
from compare.report.document import Rows, Table, Value
from compare.study.record import RunRecord
from compare.study.references import find_reference
from compare.study.task import IPOPT
from nlp_gait.formulation import load
from nlp_gait.gaits.walk12.walk12_model import Zmp, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import Horizon
from nlp_gait.gaits.walk12.walk12_steps import JOINTS

CHECKS = bind_checks("walk12/walk12_claims.toml", vars(walk12_claims))
PRINTED_DIGIT = 5e-5  # a difference below this is rounding
PLATEAU_M = 1e-4  # a step length this close to its bound is on a plateau
SAME_OPTIMUM = 2e-4  # starts whose f differs by less agree
SEARCHES = ("ga", "pso")


def _run_walk12(runner: Runner, effort: Walk12Effort) -> Walk12Findings:
    """Run Table III under both normalisations, Table IV, the errata and both paths."""
    records = runner.run_tasks(runs.make_first_tasks(effort))
    records |= runner.run_tasks(runs.make_second_tasks(effort, records))
    paths = runner.compute(runs.make_paths(effort), code=(runs,))
    weighted, front = ([PathPoint(**row) for row in rows] for rows in paths.values())
    starts = {row.weight: records[runs.title_table_3(PAPER, row.weight), IPOPT] for row in TABLE_3}
    optima = {weight: get_point(choose_best(done)) for weight, done in starts.items()}
    return Walk12Findings(
        runs=records,
        weighted=weighted,
        front=front,
        printed_step=runner.compute(runs.make_printed_step(effort, optima), code=(runs,))["printed-step"],
    )


def make_trajectories(findings: Walk12Findings) -> list[Table]:
    """Return two steps of IPOPT's gaits, straight ahead and on a circle."""
    header = ["t_s", *(f"{joint}_rad" for joint in JOINTS), "zmp_x_m", "zmp_y_m", "left_stance"]
    tables = []
    for name, weight, turn_rad in (("walk-straight", 0.15, 0.0), ("walk-circle", TURNING_WEIGHT, TURN_RAD)):
        arrays = follow(get_point(findings.optimum(PAPER, weight)), intervals=50, turn_rad=turn_rad)
        rows = np.column_stack([arrays[signal] for signal in ("t", "q", "zmp", "left_stance")]).tolist()
        tables.append(Table(name=name, columns=dict.fromkeys(header, ""), rows=rows))
    return tables


def _compute_values(findings: Walk12Findings) -> dict[str, Any]:
    problem, robot = load("walk12"), load_point_mass_biped()
    lengths = [problem.value(f"step_length_m.{end}") for end in ("lower", "upper")]
    every = {n: [run for row in TABLE_3 for run in findings.records(PAPER, row.weight, n)] for n in ("ga", IPOPT)}
    return {
        "own": robot,
        "bounds": problem.variables,
        "ga_evaluations": runs.GA_EVALUATIONS,
        "f1max": F1MAX,
        "f2max": F2MAX,
        "knee_rad": problem.value("reach_margin_rad"),
        "agree": SAME_OPTIMUM,
        "dense_intervals": DENSE_INTERVALS,
        "s_bounds": lengths,
        "longest_mm": 1e3 * lengths[1],
        "stable_step_s": TABLE_3[-1].step_time_s,
        "hip_aside_mm": 1e3 * robot.hip_distance_m / 2,
        "sole_reach_mm": 1e3 * robot.foot_width_m / 2,
        "branch_m": CHECKS["inverse-kinematics"](findings).values["branch_m"],
        "corner_m": CORNER_M,
        "corner_leg_mm": 1e3 * (robot.leg_m - 2 * CORNER_M),
        "instants": int(problem.options["intervals"]) // 2 + 1,
        "circle_off_mm": CHECKS["circle"](findings).values["off"],
        "time_s": {name: float(np.median([run.time_s.solve for run in done])) for name, done in every.items()},
        **_compute_normalisation(findings),
        **_compute_tradeoff(findings, *lengths),
        **_compute_errata(findings),
        **_compute_choices(findings),
    }


def _compute_normalisation(findings: Walk12Findings) -> dict[str, Any]:
    ga = list_f(findings.records(PAPER, 1.0, "ga"))
    optima = zip(TABLE_3, list_objectives(_list_optima(findings, MODEL)), strict=True)
    gaps = {row.weight: row.f - f for row, f in optima}
    leads = {}
    for label in (PAPER, MODEL):
        pairs = zip(_list_optima(findings, label), findings.f_of_printed_gaits(label), strict=True)
        leads[f"lead_{label}"] = compute_range(_get_dense(optimum)["f"] - f for optimum, f in pairs)
    last_f1 = findings.f1_by()[-1]
    return {
        **leads,
        "own_f1max": findings.own_f1max,
        "dense_f1max": _get_dense(findings.optimum(PAPER, 1.0))["f1_per_m2s"],
        "ga_f1": (min(ga) * F1MAX, max(ga) * F1MAX),
        "ga_f1_median": float(np.median(ga)) * F1MAX,
        "last_f1": last_f1,
        "model_part": 100 * (last_f1 / TABLE_3[-1].implied_f1 - 1),
        "search_part": 100 * (findings.own_f1max / last_f1 - 1),
        "printed_above": ", ".join(f"{w:g} (by {gap:.4f})" for w, gap in gaps.items() if gap > PRINTED_DIGIT),
    }


def _list_optima(findings: Walk12Findings, label: str) -> list[RunRecord]:
    return [findings.optimum(label, row.weight) for row in TABLE_3]


def _compute_tradeoff(findings: Walk12Findings, shortest: float, longest: float) -> dict[str, Any]:
    weighted = findings.weighted
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


def _compute_errata(findings: Walk12Findings) -> dict[str, Any]:
    (corner,) = findings.runs["corner", IPOPT]
    rounded = [list_rounded(row) for row in TABLE_4]  # each as printed first
    gaps = {h: np.array([[_compute_gap(near, h) for near in rows] for rows in rounded]) for h in HORIZONS}
    return {
        "f1_change": {zmp: findings.describe_f1_change(zmp) for zmp in get_args(Zmp)},
        "read": {zmp: _describe_reading(findings, zmp) for zmp in runs.READINGS},
        "hip_miss_mm": walk12_paper.PAPER.hip_miss_mm,
        "corner_f": corner.verdict.objective,
        "lateral_jump": math.pi * find_row(0.15).x[1],
        "up_mm": 1e3 * load_point_mass_biped().foot_com_height_m,
        "lift_mm": 1e3 * find_row(0.15).x[2],
        "stable": findings.stable[-1],
        "f1_read": CHANGES,
        "shares": SHARES,
        "stable_intervals": ", ".join(
            f"{stable.first_s:.2f} to {stable.last_s:.2f} s at λ = {row.weight:g}"
            for row, stable in [(TABLE_3[k], findings.stable[k]) for k in (0, 1, -1)]
        ),
        "gap": {h: compute_range(gaps[h][:, 0]) for h in HORIZONS},
        "least_gap": {h: compute_range(gaps[h].min(axis=1)) for h in HORIZONS},
        "f1max_by_T": join_words(f"{value:.0f}" for value in list_f1max(findings, "step")),
    }


def _compute_gap(row: PaperRow, horizon: Horizon) -> float:
    """Difference [%] between f1 of a printed gait and what its printed f implies."""
    return 100 * abs(compute_f1(row, horizon=horizon) / row.implied_f1 - 1)


def _describe_reading(findings: Walk12Findings, zmp: Zmp) -> str:
    """Return f1max, the optimum at lambda = 0.15 and where the optimum moves between both ends of s, by a reading."""
    ends = [findings.best(f"{zmp}-{weight:g}") for weight in (0.15, 1.0)]
    long, short = (get_point(run)[0] / F2MAX for run in ends)
    low, high = (run.verdict.indexes["f1_per_m2s"] / F1MAX for run in ends)
    weight = (long - short) / (long - short + high - low)
    return (
        f"f1max becomes {F1MAX * high:.2f}, the optimum at λ = 0.15 {ends[0].verdict.objective:.4f}, and both ends of s have "
        f"the same f at λ = {weight:.3f}"
    )


def _compute_choices(findings: Walk12Findings) -> dict[str, Any]:
    weights = runs.BENT_FREELY_WEIGHTS
    unbent = [findings.best(f"no-reach-margin-{weight:g}") for weight in weights]
    simpson = [findings.best(f"simpson-{row.weight:g}") for row in TABLE_3]
    shifts = [abs(f - findings.optimum(PAPER, float(w)).verdict.objective) for w, f in findings.printed_step.items()]
    ga = {name: findings.records(PAPER, runs.VARIANTS_WEIGHT, name) for name in ("ga", *runs.GA_VARIANTS)}
    epoch = runs.GA_EVALUATIONS - runs.GA.population
    histories = [run.history for run in ga["ga"]]
    earlier = [f for h in histories for e, f in zip(h.evaluations, h.objective, strict=True) if e == epoch]
    bounds = {"bound": _find_bound(findings.optimum(PAPER, 1.0)), "simpson_bound": _find_bound(simpson[-1])}
    return {
        "ga_gap": _compute_ga_gaps(findings, [runs.title_table_3(PAPER, row.weight) for row in TABLE_3]),
        "ga_gap_4": _compute_ga_gaps(findings, [runs.title_table_4(row, "step") for row in TABLE_4]),
        "bent_weights": join_words(f"{weight:g}" for weight in weights),
        "unbent": join_words(f"{f:.6f}" for f in list_objectives(unbent)),
        "bent": join_words(f"{findings.optimum(PAPER, weight).verdict.objective:.6f}" for weight in weights),
        "straightest": min(compute_knees(get_point(best)).min() for best in _list_optima(findings, PAPER)),
        "printed_step": f"the optima at λ = {', '.join(findings.printed_step)} change by at most {max(shifts):.0e} in f",
        "simpson_claim": max(r.verdict.objective - _get_dense(r)["f"] for r in simpson),
        "simpson_f1max": simpson[-1].verdict.objective * F1MAX,
        **{name: "none is shipped" if bound is None else f"{bound:.6f}" for name, bound in bounds.items()},
        "ga_900": float(np.median([f for f in earlier if f is not None])),
        "ga_medians": {name: float(np.median(list_f(records))) for name, records in ga.items()},
    }


def _compute_ga_gaps(findings: Walk12Findings, titles: Iterable[str]) -> tuple[float, float]:
    """Least and greatest distance [%] of the median f of the GA's runs from the optimum."""
    pairs = ((findings.runs[title, "ga"], findings.best(title)) for title in titles)
    return compute_range(100 * (1 - float(np.median(list_f(ga))) / best.verdict.objective) for ga, best in pairs)


def _find_bound(record: RunRecord) -> float | None:
    return find_reference(record.definition["problem"]).bound


def _get_dense(record: RunRecord) -> Mapping[str, float]:
    return record.verdict.dense or {}


def _make_tables(findings: Walk12Findings) -> dict[str, Rows]:
    return {
        "table3-paper": _list_table_3(findings, PAPER),
        "table3-model": _list_table_3(findings, MODEL),
        "gaits": _list_gaits(findings),
        "readings": _list_readings(findings),
        "table4": _list_table_4(findings),
        "quadrature": _list_quadratures(findings),
        "second-optima": [row for weight in (0.9, 1.0) for row in _list_second_optima(findings, weight)],
    }


def _list_quadratures(findings: Walk12Findings) -> Rows:
    rows = []
    for row in TABLE_3:
        best = findings.optimum(PAPER, row.weight)
        simpson = findings.best(f"simpson-{row.weight:g}")
        ours = [best.verdict.objective, _find_bound(best), findings.printed_step.get(f"{row.weight:g}")]
        rows.append([row.weight, *ours, simpson.verdict.objective, _get_dense(simpson)["f"], _find_bound(simpson)])
    return rows


def _list_second_optima(findings: Walk12Findings, weight: float) -> Rows:
    """Both gaits at which starts of IPOPT end, where there are two: the best one, and the best that does not agree with it."""
    begun, best = findings.records(PAPER, weight, IPOPT), findings.optimum(PAPER, weight)
    ends = [run for run in begun if run.claimed and run.verdict.feasible]
    other = [run for run in ends if best.verdict.objective - run.verdict.objective >= SAME_OPTIMUM]
    rows: list[list[Value]] = []
    for run in (best, *([choose_best(other)] if other else [])):
        agreeing = sum(abs(end.verdict.objective - run.verdict.objective) < SAME_OPTIMUM for end in ends)
        x = get_point(run)
        rows.append([weight, agreeing, run.verdict.objective, *x, float(compute_knees(x).min())])
    return rows


def _list_table_3(findings: Walk12Findings, label: str) -> Rows:
    rows = []
    for row, of_printed_gait in zip(TABLE_3, findings.f_of_printed_gaits(label), strict=True):
        cells: list[Value] = [row.weight, row.f, of_printed_gait]
        for name in SEARCHES:
            f = list_f(findings.records(label, row.weight, name))
            cells += [max(f), float(np.median(f)), min(f)]
        begun, optimum = findings.records(label, row.weight, IPOPT), findings.optimum(label, row.weight)
        f_best = optimum.verdict.objective
        agreeing = sum(r.claimed and abs(r.verdict.objective - f_best) < SAME_OPTIMUM for r in begun)
        solved = (findings.records(label, row.weight, "ga"), begun)
        times = [float(np.median([run.time_s.solve for run in done])) for done in solved]
        rows.append([*cells, f_best, _get_dense(optimum)["f"], agreeing, *times])
    return rows


def _list_gaits(findings: Walk12Findings) -> Rows:
    rows: list[Sequence[Value]] = []
    for row, f1, stable in zip(TABLE_3, findings.f1_by(), findings.stable, strict=True):
        rows.append([row.weight, "paper", *row.x, f1, stable.share])
        for solver in (*SEARCHES, IPOPT):
            found = choose_best(findings.records(PAPER, row.weight, solver))
            figures = _get_dense(found)
            rows.append([row.weight, solver.upper(), *get_point(found), figures["f1_per_m2s"], figures["stable_share"]])
    return rows


def _list_readings(findings: Walk12Findings) -> Rows:
    """f1 of the printed gaits by each reading of the ZMP, and f and the optimum with (A1) as printed."""
    printed: Zmp = "appendix-as-printed"
    columns = [findings.f1_by(zmp) for zmp in ("exact", "moment-free", "appendix", printed)]
    columns += [findings.f_of_printed_gaits(PAPER, printed), findings.list_optima(printed)]
    return [[row.weight, row.f, row.implied_f1, *values] for row, *values in zip(TABLE_3, *columns, strict=True)]


def _list_table_4(findings: Walk12Findings) -> Rows:
    rows: list[Sequence[Value]] = []
    for row, horizon in product(TABLE_4, HORIZONS):
        optimum = findings.best(runs.title_table_4(row, horizon))
        f1max = runs.find_f1max(findings.runs, runs.title_table_4(row, horizon, most_stable=True))
        ours = [compute_f1(row, horizon=horizon), f1max, optimum.verdict.objective, *get_point(optimum)]
        words = {"step": "0 to T", "1s": "1 s"}[horizon]
        rows.append([row.step_time_s, words, row.f1max, row.f, row.implied_f1, *ours])
    return rows


REPRODUCTION = Reproduction(
    name="walk12",
    full=Walk12Effort(),
    run=_run_walk12,
    values=_compute_values,
    tables=_make_tables,
    figures=draw_figures,
    checks=CHECKS,
    csv_tables=make_trajectories,
)
