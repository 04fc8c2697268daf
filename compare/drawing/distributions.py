"""Figures of distributions: run lengths over targets, final gaps over runs, solvers over problems."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.distribution import ECDF_TARGETS, ecdf, performance_profile
from compare.analysis.statistics.run_length import TARGETS
from compare.drawing.convergence import cost_figure, shown_percent
from compare.drawing.figures import Look, legend_below, logarithmic, looks, new_figure, style
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def ecdf_figure(comparison: Comparison) -> Figure:
    """Share of all pairs of run and target solved within a cost, in evaluations and in seconds."""

    def draw(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
        last = max([c.total(axis) for s in comparison.solvers if s.knows(axis) for c in s.curves] + [1e-3])
        costs = np.array([c.reached(target, axis) for c in solver.curves for target in ECDF_TARGETS])
        at, share = ecdf(costs)
        if at.size:
            at, share = np.append(at, max(last, at[-1])), np.append(share, share[-1])
        _draw_share(axes, at, share, solver.name, look)

    return cost_figure(comparison, draw, "share of runs and targets")


def suite_figure(comparisons: Sequence[Comparison]) -> Figure:
    """Share of all triples of problem, run and target solved within evaluations per variable; solvers that ran on all."""
    solvers = [{solver.name: solver for solver in comparison.solvers} for comparison in comparisons]
    shared = [name for name in solvers[0] if all(name in on_problem for on_problem in solvers)]
    with style():
        figure = new_figure(7.4, 3.6)
        axes = figure.subplots()
        drawn = {}
        for name in shared:
            runs = [(curve, len(s[name].records[0].x) or 1) for s in solvers for curve in s[name].curves]
            costs = np.array([curve.reached(target) / n for curve, n in runs for target in ECDF_TARGETS])
            drawn[name] = (*ecdf(costs), max([curve.total() / n for curve, n in runs] + [1.0]))
        last = max(end for _, _, end in drawn.values())
        best_first = sorted(drawn, key=lambda name: -drawn[name][1][-1] if drawn[name][1].size else 0.0)
        for name, look in looks(best_first).items():
            at, share, _ = drawn[name]
            if at.size:
                at, share = np.append(at, max(last, at[-1])), np.append(share, share[-1])
            _draw_share(axes, at, share, name, look)
        axes.set_xlabel("equivalent evaluations per variable")
        axes.set_ylabel("share of problems, runs and targets")
        logarithmic(axes)
        legend_below(figure)
    return figure


def final_gap_figure(comparison: Comparison) -> Figure:
    """Gap of each run at its end, one row a solver; infeasible runs as crosses at the right edge."""
    with style():
        figure = new_figure(7.4, 0.8 + 0.28 * len(comparison.solvers))
        axes = figure.subplots()
        names = [solver.name for solver in comparison.solvers]
        for row, (solver, look) in enumerate(zip(comparison.solvers, looks(names).values(), strict=True)):
            gaps = np.array([comparison.gap(cost) for cost in solver.costs])
            known = np.isfinite(gaps)
            shown = shown_percent(gaps[known])
            axes.plot(shown, [row] * len(shown), look.marker, color=look.colour, markerfacecolor="none", alpha=0.8)
            if known.any():
                axes.plot(np.median(shown), row, "|", color=look.colour, markersize=16, markeredgewidth=2)
            missing = int((~known).sum())
            if missing:
                beside = axes.get_yaxis_transform()
                axes.text(1.0, row, f"{missing} infeasible", transform=beside, ha="right", va="center", fontsize=8)
        logarithmic(axes)
        axes.set_xlabel("gap to the best known at the end [%], bars: medians")
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
    return figure


def profile_figure(comparisons: Sequence[Comparison]) -> Figure:
    """Performance profile of expected running times over problems and targets, for solvers that ran on all of them."""
    with style():
        costs = expected_costs(comparisons)
        figure = new_figure(4.6, 2.8)
        axes = figure.subplots()
        profile = performance_profile(costs)
        last = max([factor[-1] for factor, _ in profile.values() if factor.size], default=1.0) * 2.0
        for name, look in looks(profile).items():
            factor, share = profile[name]
            height = np.append(share, share[-1] if share.size else 0.0)
            _draw_share(axes, np.append(factor, last), height, name, look)
        logarithmic(axes)
        axes.set_xlim(left=1.0)
        axes.set_xlabel("factor of the cheapest solver's expected evaluations")
        axes.set_ylabel("share of problems and targets")
        legend_below(figure)
    return figure


def _draw_share(axes: Axes, at: Array, share: Array, name: str, look: Look) -> None:
    axes.step(at, share, where="post", color=look.colour, linestyle=look.line, label=name)
    axes.set_ylim(0.0, 1.02)


def expected_costs(comparisons: Sequence[Comparison]) -> dict[str, list[float]]:
    """By solver, expected evaluations for each problem and target; only solvers that ran on all problems."""
    found = [{solver.name: solver for solver in comparison.solvers} for comparison in comparisons]
    shared = [name for name in found[0] if all(name in solvers for solvers in found)] if found else []
    return {name: [solvers[name].expected_cost(target) for solvers in found for target in TARGETS] for name in shared}
