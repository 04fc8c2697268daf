"""Charts of a comparison: gaps over costs, shares of solved targets, final gaps of runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.analysis.comparison import SMALLEST_GAP, Comparison, SolverRuns, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, compute_band, compute_ecdf
from compare.drawing.charts import Chart, Series
from nlp_gait.formulation import Array

GRID_POINTS = 120
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}
GAP = "gap to best known [%]"


def make_final_gap_charts(comparison: Comparison) -> list[Chart]:
    """Return the final gap of each run, one row per solver, and its median as a bar."""
    series, rows = [], []
    for height, solver in zip(range(len(comparison.solvers), 0, -1), comparison.solvers, strict=True):
        gaps = [comparison.gap(cost) for cost in solver.costs]
        shown = [(run, gap) for run, gap in enumerate(gaps) if np.isfinite(gap)]
        notes = [f"{solver.title}, run {run}: {comparison.format_gap(gap)}" for run, gap in shown]
        x, y = clip_percent(np.array([gap for _, gap in shown])), np.full(len(shown), float(height))
        series.append(Series(name=solver.title, x=x, y=y, shape="points", notes=notes))
        if np.isfinite(middle := comparison.gap(solver.median_cost)):
            bar = clip_percent(np.array([middle, middle]))
            series.append(Series(name=solver.title, x=bar, y=np.array([height - 0.35, height + 0.35])))
        rows.append((solver.title, _describe_row(comparison, solver, middle)))
    return [Chart(x="gap to best known [%], bar: median", y="", series=series, log=(True, False), rows=rows)]


def _describe_row(comparison: Comparison, solver: SolverRuns, gap: float) -> str:
    """Return the median gap, and how many runs reach the best known value, or are feasible if not all are."""
    runs, feasible = len(solver.records), len(solver.feasible)
    if feasible < runs:
        return f"{comparison.format_gap(gap)}, {feasible} of {runs} feasible" if feasible else "infeasible"
    return f"{comparison.format_gap(gap)}, {comparison.count_reached(solver)} of {runs} reach it"


def make_convergence_charts(comparison: Comparison) -> list[Chart]:
    """Return bands from the least to the greatest gap of all runs, with the median, over evaluations and over seconds.

    A line begins where half of the runs are feasible, a band where all are. A run of a gradient method is a point at its end.
    """
    charts = []
    for axis, words in AXES.items():
        series = [s for solver in comparison.solvers if solver.has_costs(axis) for s in _trace_gaps(solver, axis)]
        charts += [Chart(x=words, y=GAP, series=series, log=(True, True))] if series else []
    return charts


def _trace_gaps(solver: SolverRuns, axis: str) -> list[Series]:
    costs = [getattr(curve, axis) for curve in solver.curves]
    if all(len(curve.gap) <= 1 for curve in solver.curves):
        ends = [(cost[-1], c.gap[-1]) for cost, c in zip(costs, solver.curves, strict=True) if len(cost)]
        x, gap = np.array([end for end in ends if np.isfinite(end[1])]).reshape(-1, 2).T
        return [Series(name=solver.title, x=x, y=clip_percent(gap), shape="points")]
    used = np.concatenate(costs)
    used = used[used > 0.0]
    if not used.size:
        return []
    grid = np.geomspace(used.min(), used.max(), GRID_POINTS)
    low, middle, high = compute_band(costs, [np.minimum.accumulate(curve.gap) for curve in solver.curves], grid)
    finite, whole = np.isfinite(middle), np.isfinite(high)
    upper = clip_percent(high[whole])
    return [
        Series(name=solver.title, x=grid[whole], y=clip_percent(low[whole]), upper=upper, shape="band"),
        Series(name=solver.title, x=grid[finite], y=clip_percent(middle[finite])),
    ]


def clip_percent(gap: Array) -> Array:
    """Return the gap in percent; smaller ones than ``SMALLEST_GAP`` are drawn at it."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)


def make_ecdf_charts(comparisons: Sequence[Comparison], *, per_variable: bool = False) -> list[Chart]:
    """Return the share of problems, runs and targets solved within evaluations; of solvers that ran on all problems."""
    solvers, shared = index_solvers(comparisons)
    series, last = [], 1.0
    for name in shared:
        runs = [
            (curve, len(s[name].records[0].x) or 1 if per_variable else 1)
            for s in solvers
            if s[name].has_costs("evaluations")
            for curve in s[name].curves
        ]
        costs, share = compute_ecdf(np.array([c.cost_to_reach(target) / n for c, n in runs for target in ECDF_TARGETS]))
        last = max([last, *(curve.total_cost() / n for curve, n in runs)])
        series.append((solvers[0][name].title, costs, share))
    series.sort(key=lambda one: -one[2][-1] if one[2].size else 0.0)
    ends = [(np.append(costs, last), np.append(share, share[-1:])) for _, costs, share in series if share.size]
    names = [name for name, _, share in series if share.size]
    words = "equivalent evaluations per variable" if per_variable else AXES["evaluations"]
    steps = [Series(name=name, x=x, y=y, shape="step") for name, (x, y) in zip(names, ends, strict=True)]
    y = "share of problems, runs and targets" if len(comparisons) > 1 else "share of runs and targets"
    return [Chart(x=words, y=y, series=steps, log=(True, False), range=(0.0, 1.02))]
