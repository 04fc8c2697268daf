"""Figures of a comparison: gaps over costs, shares of solved targets, final gaps of runs, solvers over problems."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns, index_solvers
from compare.analysis.overview import Ranking
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS, compute_band, compute_ecdf, compute_profiles
from compare.drawing.figures import (
    Look,
    add_legend_below,
    assign_looks,
    make_axes,
    make_figure,
    use_log_axes,
    use_style,
)
from nlp_gait.formulation import Array
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative gaps below this are drawn at this value: solvers' tolerances are near it.
SMALLEST_GAP = FEASIBILITY_TOLERANCE
GRID_POINTS = 300
Draw = Callable[["Axes", SolverRuns, Look, str], None]
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}


def plot_convergence(comparison: Comparison, *, column: bool = False) -> Figure:
    """Plot bands from the least to the greatest gap of all runs, with the median, over evaluations and seconds.

    A line begins where half of the runs are feasible, a band where all are. A run of a gradient method is a point at its end.
    A figure for a printed column shows evaluations alone and has the width of the style's ``figure.figsize``.
    """
    return plot_by_cost(comparison, _draw_gaps, "gap to the best known [%]", both=True, column=column)


def plot_by_cost(comparison: Comparison, draw: Draw, words: str, both: bool = False, *, column: bool = False) -> Figure:
    """Plot over evaluations and over seconds; ``draw`` receives the axes, a solver, its look and the kind of cost."""
    look = assign_looks([solver.name for solver in comparison.solvers])
    with use_style():
        shown = ["evaluations"] if column else list(AXES)
        figure = make_figure(None if column else 7.4, 2.8)
        for axes, axis in zip(figure.subplots(1, len(shown), sharey=True, squeeze=False)[0], shown, strict=True):
            for solver in comparison.solvers:
                if solver.has_costs(axis):
                    draw(axes, solver, look[solver.name], axis)
            axes.set_xlabel(AXES[axis])
            use_log_axes(axes, both)
        figure.axes[0].set_ylabel(words)
        add_legend_below(figure)
    return figure


def _draw_gaps(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    if any(len(curve.gap) > 1 for curve in solver.curves):
        _draw_band(axes, solver, look, axis)
        return
    ends = [(c.total_cost(axis), float(c.gap[-1])) for c in solver.curves if len(c.gap) and np.isfinite(c.gap[-1])]
    label = f"{solver.name}, {len(ends)} of {len(solver.curves)} runs"
    cost, gap = np.array(ends).T if ends else (np.empty(0), np.empty(0))
    axes.plot(cost, clip_percent(gap), look.marker, color=look.colour, label=label, markerfacecolor="none")


def _draw_band(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    costs = [getattr(c, axis) for c in solver.curves]
    used = np.concatenate(costs)
    used = used[used > 0.0]
    label = f"{solver.name}, {len(costs)} runs"
    if not used.size:
        axes.plot([], [], color=look.colour, linestyle=look.line, label=label)
        return
    grid = np.geomspace(used.min(), used.max(), GRID_POINTS)
    best_so_far = [np.minimum.accumulate(c.gap) for c in solver.curves]
    low, middle, high = compute_band(costs, best_so_far, grid)
    known, whole = np.isfinite(middle), np.isfinite(high)
    axes.plot(grid[known], clip_percent(middle[known]), color=look.colour, linestyle=look.line, label=label)
    axes.fill_between(
        grid[whole], clip_percent(low[whole]), clip_percent(high[whole]), color=look.colour, alpha=0.15, linewidth=0
    )


def clip_percent(gap: Array) -> Array:
    """Return the gap in percent, not below the smallest one shown."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)


def plot_ecdf(comparison: Comparison, *, column: bool = False) -> Figure:
    """Plot the share of all pairs of run and target solved within a cost, in evaluations and in seconds."""

    def draw(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
        last = max([c.total_cost(axis) for s in comparison.solvers if s.has_costs(axis) for c in s.curves] + [1e-3])
        costs = np.array([c.cost_to_reach(target, axis) for c in solver.curves for target in ECDF_TARGETS])
        at, share = compute_ecdf(costs)
        _draw_share(axes, at, share, solver.name, look, last)

    return plot_by_cost(comparison, draw, "share of runs and targets", column=column)


def plot_suite_ecdf(comparisons: Sequence[Comparison]) -> Figure:
    """Plot the share of problems, runs and targets solved within evaluations per variable; solvers that ran on all."""
    solvers, shared = index_solvers(comparisons)
    with use_style():
        figure, axes = make_axes(7.4, 3.6)
        drawn = {}
        for name in shared:
            runs = [(curve, len(s[name].records[0].x) or 1) for s in solvers for curve in s[name].curves]
            costs = np.array([curve.cost_to_reach(target) / n for curve, n in runs for target in ECDF_TARGETS])
            drawn[name] = (*compute_ecdf(costs), max([curve.total_cost() / n for curve, n in runs] + [1.0]))
        last = max(end for _, _, end in drawn.values())
        best_first = sorted(drawn, key=lambda name: -drawn[name][1][-1] if drawn[name][1].size else 0.0)
        for name, look in assign_looks(best_first).items():
            _draw_share(axes, *drawn[name][:2], name, look, last)
        axes.set_xlabel("equivalent evaluations per variable")
        axes.set_ylabel("share of problems, runs and targets")
        use_log_axes(axes)
        add_legend_below(figure)
    return figure


def plot_final_gaps(comparison: Comparison, *, column: bool = False) -> Figure:
    """Plot the final gap of each run, one row per solver; infeasible runs are counted at the right edge."""
    with use_style():
        figure, axes = make_axes(None if column else 7.4)
        figure.set_figheight(0.8 + 0.28 * len(comparison.solvers))
        names = [solver.name for solver in comparison.solvers]
        for row, (solver, look) in enumerate(zip(comparison.solvers, assign_looks(names).values(), strict=True)):
            gaps = np.array([comparison.gap(cost) for cost in solver.costs])
            known = np.isfinite(gaps)
            shown = clip_percent(gaps[known])
            axes.plot(shown, [row] * len(shown), look.marker, color=look.colour, markerfacecolor="none", alpha=0.8)
            if known.any():
                axes.plot(np.median(shown), row, "|", color=look.colour, markersize=16, markeredgewidth=2)
            missing = int((~known).sum())
            if missing:
                beside = axes.get_yaxis_transform()
                axes.text(
                    1.0, row, f"{missing} infeasible", transform=beside, ha="right", va="center", fontsize="small"
                )
        use_log_axes(axes)
        axes.set_xlabel("gap to the best known at the end [%], bars: medians")
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
    return figure


def plot_performance_profile(comparisons: Sequence[Comparison]) -> Figure:
    """Plot the performance profile of expected running times over problems and targets; solvers that ran on all."""
    with use_style():
        costs = list_expected_costs(comparisons)
        figure, axes = make_axes(4.6, 2.8)
        profile = compute_profiles(costs)
        last = max([factor[-1] for factor, _ in profile.values() if factor.size], default=1.0) * 2.0
        for name, look in assign_looks(profile).items():
            _draw_share(axes, *profile[name], name, look, last)
        use_log_axes(axes)
        axes.set_xlim(1.0, last)
        axes.set_xlabel("factor of the cheapest solver's expected evaluations")
        axes.set_ylabel("share of problems and targets")
        add_legend_below(figure)
    return figure


def plot_critical_difference(ranking: Ranking) -> Figure:
    """Plot mean ranks on a line; a bar joins those that differ by less than the critical difference.

    Source:
        Demsar (2006), Statistical comparisons of classifiers over multiple data sets, section 3.2.4.
    """
    names, ranks = list(ranking.mean_ranks), np.array([*ranking.mean_ranks.values()])
    width = ranking.critical_difference or 0.0
    ends = [int(np.searchsorted(ranks, rank + width, side="left")) - 1 for rank in ranks]
    bars = [(first, last) for first, last in enumerate(ends) if last > first and last not in ends[:first]]
    half = (len(names) + 1) // 2  # names to the left; the others are to the right, from below
    with use_style():
        figure, axes = make_axes(7.4, 0.9 + 0.14 * len(bars) + 0.2 * half)
        for height, (first, last) in enumerate(bars, start=1):
            axes.plot(ranks[[first, last]] + [-0.03, 0.03], [-0.5 * height] * 2, color="black", linewidth=3.0)
        for place, (name, look) in enumerate(assign_looks(names).items()):
            is_left = place < half
            low = -0.5 * len(bars) - (place + 1 if is_left else len(names) - place)
            edge = ranks[0] - 0.3 if is_left else ranks[-1] + 0.3
            axes.plot([ranks[place], ranks[place], edge], [0.0, low, low], color=look.colour, linewidth=1.0)
            axes.text(edge, low, f" {name} {ranks[place]:.2f} ", ha="right" if is_left else "left", va="center")
        axes.xaxis.set_ticks_position("top")
        axes.xaxis.set_label_position("top")
        axes.set_xlabel(f"mean rank, critical difference {width:.2f}")
        axes.set_ylim(-0.5 * len(bars) - half - 0.6, 0.0)
        axes.set_xlim(ranks[0] - 0.25, ranks[-1] + 0.25)
        axes.yaxis.set_visible(False)
        axes.spines[["left", "right", "bottom"]].set_visible(False)
        axes.grid(visible=False)
    return figure


def _draw_share(axes: Axes, at: Array, share: Array, name: str, look: Look, last: float) -> None:
    """Draw a share that rises at some costs, up to a last cost."""
    if at.size:
        at, share = np.append(at, max(last, at[-1])), np.append(share, share[-1])
    axes.step(at, share, where="post", color=look.colour, linestyle=look.line, label=name)
    axes.set_ylim(0.0, 1.02)


def list_expected_costs(comparisons: Sequence[Comparison]) -> dict[str, list[float]]:
    """Return expected evaluations for each problem and target by solver.

    Only solvers that ran on all problems with known evaluations.
    """
    found, shared = index_solvers(comparisons)
    shared = [name for name in shared if all(solvers[name].has_costs("evaluations") for solvers in found)]
    return {name: [solvers[name].expected_cost(target) for solvers in found for target in TARGETS] for name in shared}
