"""Convergence of search algorithms against IPOPT's optimum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.figures import COLOURS, new_figure, style
from compare.record import RunRecord
from compare.runner import IPOPT
from nlp_gait.problems.gait_problem import Objective

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative gaps below this are drawn at this value: both solvers' tolerances end near it.
SMALLEST_GAP = 1e-8


def convergence_figure(records: Sequence[RunRecord], objective: Objective) -> Figure:
    """Best so far against evaluations for all runs of one problem: value on the left, gap to the best known on the right.

    Each band goes from the best to the worst run, its line is the median; a line starts where half of the runs are
    feasible, a band where all are. IPOPT is a level line: the best of its starts.
    """
    best = best_known(records, objective)
    with style():
        figure = new_figure(6.6, 3.0)
        left, right = figure.subplots(1, 2)
        for name in dict.fromkeys(record.algorithm for record in records):
            runs = [record for record in records if record.algorithm == name]
            if name == IPOPT:
                _draw_ipopt(left, runs, objective)
            else:
                _draw_search(left, right, name, runs, best, objective)
        left.set_xlabel("evaluations")
        left.set_ylabel(f"best {objective.name} so far [{objective.unit}]")
        right.set_xlabel("evaluations")
        right.set_ylabel("gap to the best known [%]")
        right.set_yscale("log")
        for axes in (left, right):
            axes.set_xscale("log")
        left.legend()
    return figure


def best_known(records: Sequence[RunRecord], objective: Objective) -> float:
    """Best objective that the judge finds feasible; NaN if none is."""
    costs = [objective.sign * r.verdict.objective for r in records if r.verdict.feasible]
    return objective.sign * min(costs) if costs else float("nan")


def _draw_ipopt(axes: Axes, runs: Sequence[RunRecord], objective: Objective) -> None:
    value = best_known(runs, objective)
    solved = sum(run.verdict.feasible for run in runs)
    axes.axhline(
        value, color=COLOURS[IPOPT], linestyle="--", label=f"ipopt, best of {len(runs)} starts ({solved} feasible)"
    )


def _draw_search(
    left: Axes, right: Axes, name: str, runs: Sequence[RunRecord], best: float, objective: Objective
) -> None:
    evaluations, costs = _costs(runs, objective)
    low, middle, high = np.min(costs, axis=0), np.median(costs, axis=0), np.max(costs, axis=0)
    colour = COLOURS.get(name, "#666666")
    label = f"{name}, {len(runs)} runs"
    for axes, show in (
        (left, lambda cost: objective.sign * cost),
        (right, lambda cost: 100 * np.maximum((cost - objective.sign * best) / abs(best), SMALLEST_GAP)),
    ):
        known = np.isfinite(middle)
        axes.plot(evaluations[known], show(middle[known]), color=colour, label=label)
        whole = np.isfinite(high)
        axes.fill_between(evaluations[whole], show(low[whole]), show(high[whole]), color=colour, alpha=0.2, linewidth=0)


def _costs(runs: Sequence[RunRecord], objective: Objective) -> tuple[np.ndarray, np.ndarray]:
    """Evaluations (G,) common to all runs and best cost so far (runs, G), infinite while nothing was feasible."""
    evaluations = np.unique(np.concatenate([run.history.evaluations for run in runs]))
    rows = []
    for run in runs:
        cost = [np.inf if value is None else objective.sign * value for value in run.history.objective]
        position = np.searchsorted(run.history.evaluations, evaluations, side="right") - 1
        rows.append(np.where(position >= 0, np.array([*cost, np.inf])[position], np.inf))
    return evaluations, np.array(rows)
