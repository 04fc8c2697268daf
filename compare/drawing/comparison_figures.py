"""Figures of a comparison: gaps over costs, shares of solved targets, final gaps of runs, solvers over problems.

A figure is a function from a comparison to charts; ``compare.drawing.charts`` draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from compare.analysis.comparison import SMALLEST_GAP, Comparison, SolverRuns, index_solvers
from compare.analysis.overview import Ranking
from compare.analysis.record_statistics import ECDF_TARGETS, compute_band, compute_ecdf
from compare.analysis.units import format_percent
from compare.drawing.charts import Chart, Series
from nlp_gait.formulation import Array
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

GRID_POINTS = 120
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}
GAP = "gap to best known [%]"
SHARES = (0.0, 1.02)  # range of an axis


def make_final_gap_charts(comparison: Comparison) -> list[Chart]:
    """Return the final gap of each run, one row per solver, its median as a bar and the judge's tolerance as a line."""
    series, rows = [], []
    for place, solver in enumerate(comparison.solvers):
        height = len(comparison.solvers) - place
        gaps = np.array([comparison.gap(cost) for cost in solver.costs])
        finite = np.isfinite(gaps)
        runs = [record.run for record, ended in zip(solver.records, finite, strict=True) if ended]
        notes = [
            f"{solver.name}, run {run}: {format_percent(gap)}" for run, gap in zip(runs, gaps[finite], strict=True)
        ]
        x, y = clip_percent(gaps[finite]), np.full(len(runs), float(height))
        series.append(Series(name=solver.name, x=x, y=y, shape="points", notes=notes))
        if np.isfinite(middle := comparison.gap(solver.median_cost)):
            bar = clip_percent(np.array([middle, middle]))
            series.append(Series(name=solver.name, x=bar, y=np.array([height - 0.35, height + 0.35])))
        missing = len(gaps) - len(runs)
        rows.append(f"{solver.name}, {missing} infeasible" if missing else solver.name)
    limits = (0.4, len(rows) + 0.6)
    mark = 100.0 * FEASIBILITY_TOLERANCE
    return [Chart(x=GAP, y="", series=series, log=(True, False), rows=rows, range=limits, mark=mark)]


def make_convergence_charts(comparison: Comparison) -> list[Chart]:
    """Return bands from the least to the greatest gap of all runs, with the median, over evaluations and over seconds.

    A line begins where half of the runs are feasible, a band where all are. A run of a gradient method is a point at its end.
    """
    return _make_charts_by_cost(comparison, _trace_gaps, GAP, (True, True))


def make_ecdf_charts(comparison: Comparison) -> list[Chart]:
    """Return the share of all pairs of run and target solved within a cost, in evaluations and in seconds."""

    def trace(solver: SolverRuns, axis: str) -> list[Series]:
        last = max([c.total_cost(axis) for s in comparison.solvers if s.has_costs(axis) for c in s.curves] + [1e-3])
        costs = np.array([c.cost_to_reach(target, axis) for c in solver.curves for target in ECDF_TARGETS])
        return [_make_share(solver.name, *compute_ecdf(costs), last)]

    return _make_charts_by_cost(comparison, trace, "share of runs and targets", (True, False), SHARES)


def _make_charts_by_cost(
    comparison: Comparison,
    trace: Callable[[SolverRuns, str], list[Series]],
    y: str,
    log: tuple[bool, bool],
    limits: tuple[float, float] | None = None,
) -> list[Chart]:
    """Return a chart over evaluations and one over seconds; ``trace`` takes a solver and the kind of cost."""
    return [
        Chart(
            x=words,
            y=y,
            series=[s for solver in comparison.solvers if solver.has_costs(axis) for s in trace(solver, axis)],
            log=log,
            range=limits,
        )
        for axis, words in AXES.items()
    ]


def _trace_gaps(solver: SolverRuns, axis: str) -> list[Series]:
    costs = [getattr(curve, axis) for curve in solver.curves]
    if all(len(curve.gap) <= 1 for curve in solver.curves):
        ends = [(cost[-1], c.gap[-1]) for cost, c in zip(costs, solver.curves, strict=True) if len(cost)]
        x, gap = np.array([end for end in ends if np.isfinite(end[1])]).reshape(-1, 2).T
        return [Series(name=solver.name, x=x, y=clip_percent(gap), shape="points")]
    used = np.concatenate(costs)
    used = used[used > 0.0]
    if not used.size:
        return []
    grid = np.geomspace(used.min(), used.max(), GRID_POINTS)
    low, middle, high = compute_band(costs, [np.minimum.accumulate(curve.gap) for curve in solver.curves], grid)
    finite, whole = np.isfinite(middle), np.isfinite(high)
    upper = clip_percent(high[whole])
    return [
        Series(name=solver.name, x=grid[whole], y=clip_percent(low[whole]), upper=upper, shape="band"),
        Series(name=solver.name, x=grid[finite], y=clip_percent(middle[finite])),
    ]


def clip_percent(gap: Array) -> Array:
    """Return the gap in percent; smaller ones than ``SMALLEST_GAP`` are drawn at it."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)


def _make_share(name: str, costs: Array, share: Array, last: float) -> Series:
    """Return a share that rises at some costs, up to a last cost."""
    if costs.size:
        costs, share = np.append(costs, max(last, costs[-1])), np.append(share, share[-1])
    return Series(name=name, x=costs, y=share, shape="step")


def make_suite_ecdf_charts(comparisons: Sequence[Comparison]) -> list[Chart]:
    """Return the share of problems, runs and targets solved within evaluations per variable; solvers that ran on all."""
    solvers, shared = index_solvers(comparisons)
    shares, last = {}, 1.0
    for name in shared:
        runs = [(curve, len(s[name].records[0].x) or 1) for s in solvers for curve in s[name].curves]
        costs = np.array([curve.cost_to_reach(target) / n for curve, n in runs for target in ECDF_TARGETS])
        shares[name] = compute_ecdf(costs)
        last = max([last, *(curve.total_cost() / n for curve, n in runs)])
    best_first = sorted(shares, key=lambda name: -shares[name][1][-1] if shares[name][1].size else 0.0)
    series = [_make_share(name, *shares[name], last) for name in best_first]
    words = "share of problems, runs and targets"
    return [Chart(x="equivalent evaluations per variable", y=words, series=series, log=(True, False), range=SHARES)]


def make_critical_difference_charts(ranking: Ranking) -> list[Chart]:
    """Return mean ranks, one row per solver; a line reaches from each as far as the critical difference.

    Source:
        Demsar (2006), Statistical comparisons of classifiers over multiple data sets, section 3.2.4.
    """
    width, count = ranking.critical_difference or 0.0, len(ranking.mean_ranks)
    series = []
    for place, (name, rank) in enumerate(ranking.mean_ranks.items()):
        height = np.full(2, float(count - place))
        series.append(
            Series(name=name, x=np.array([rank]), y=height[:1], shape="points", notes=[f"{name}: {rank:.2f}"])
        )
        series.append(Series(name=name, x=np.array([rank, rank + width]), y=height))
    rows = [f"{name} {rank:.2f}" for name, rank in ranking.mean_ranks.items()]
    return [
        Chart(x=f"mean rank, critical difference {width:.2f}", y="", series=series, rows=rows, range=(0.4, count + 0.6))
    ]
