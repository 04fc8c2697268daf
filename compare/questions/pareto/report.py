"""A front of power against one criterion as an answer: tables and picture, with what the searches found."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.drawing.figures import COLOURS, new_figure, style
from compare.drawing.labels import axis_label
from compare.questions.answer import Answer, all_digits
from compare.questions.pareto.study import ParetoStudy
from compare.report.document import Figure, Table, text_table
from nlp_gait.formulation import GaitProblem

SEARCH_COLOURS = {
    "NSGA2": COLOURS["ga"],
    "CMOPSO": COLOURS["pso"],
    "CMOEAD": COLOURS["aco-grid"],
    "DCNSGA3": COLOURS["cma"],
}
SEARCH_NAMES = {"NSGA2": "NSGA-II", "CMOPSO": "CMOPSO", "CMOEAD": "C-MOEA/D", "DCNSGA3": "DCNSGA-III"}
MARKS = ("x", "+", ".")


def front_answer(study: ParetoStudy, problem: GaitProblem) -> Answer:
    """The front of power against one criterion, its knees, and how near the searches come.

    Args:
        study: with at least one point.
        problem: with its own demand on the criterion.
    """
    criterion, stem = study.criterion, f"{problem.name}-front-{study.criterion.name}"
    shown = "The front as a line, its knees, and what the searches found; its cheap part on the right."
    return Answer(
        stem=f"{problem.name}-pareto-{criterion.name}",
        title=f"{problem.name}: power against {criterion.name}",
        parts=(
            *_tables(study),
            *_searches(study),
            Figure(name=stem, caption=shown, drawing=front_figure(study, problem)),
            _numbers(stem, study),
        ),
        data=study.to_json(),
    )


def _tables(study: ParetoStudy) -> tuple[Table, Table]:
    """Some points of the front, and its knees."""
    criterion, front = study.criterion, study.front
    unit, per = criterion.unit, f"W per {criterion.unit}"
    picked = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    points = [(f"{p.value:z.5f} {unit}", f"{p.power_W:.5f} W", f"{p.price:.4g} {per}") for p in picked]
    title = f"Front of power against {criterion.name}, {len(front)} points, {len(picked)} shown"
    knees = [
        (f"{k.value:z.5f} {unit}", f"{k.power_W:.5f} W", f"{k.turn_deg:z.0f} degrees")
        + (f"{k.price_before:.4g} {per}", f"{k.price_after:.4g} {per}")
        for k in study.bends.knees
    ]
    turns = "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1"
    return (
        text_table((criterion.name, "power", "price"), points, title),
        text_table((criterion.name, "power", "turn", "price before", "price after"), knees, turns),
    )


def _searches(study: ParetoStudy) -> tuple[Table | str, ...]:
    """How near the searches come, if there were any."""
    outcome = study.challenge
    if outcome is None:
        return ()
    header = ("algorithm", "evaluations", "hypervolume, of the front's", "IGD", "mean power above the front")
    rows = [
        (
            q.algorithm,
            f"{q.budget:,}",
            _spread(q.hypervolume, 100, " %"),
            _spread(q.igd, 1, ""),
            _spread(q.excess, 100, " %"),
        )
        for q in study.qualities
    ]
    return (
        text_table(header, rows, "Searches: median over runs (least to greatest)"),
        f"{outcome.points} points of the searches are bettered by no other; {outcome.solved} of these, the lowest, were solved "
        f"for. The nearest is {100 * outcome.least_excess:+z.4f} % above the least power at its {study.criterion.name}; "
        f"{outcome.moved} of them moved the front, {outcome.infeasible} are infeasible for the exact functions",
    )


def _spread(values: tuple[float, float, float] | None, factor: float, unit: str) -> str:
    if values is None:
        return "-"
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"


def _numbers(stem: str, study: ParetoStudy) -> Table:
    unit = study.criterion.unit.replace("/", "_")
    header = [f"{study.criterion.name}_{unit}", "power_W", f"price_W_per_{unit}", "violation", *study.problem.names]
    return all_digits(stem, header, [[p.value, p.power_W, p.price, p.violation, *p.x] for p in study.front])


def front_figure(study: ParetoStudy, problem: GaitProblem) -> Drawing:
    """The front as a line with its knees, and on the right its lower part; what searches found as points."""
    front, criterion, knees = study.front, study.criterion, study.bends.knees
    with style():
        figure = new_figure(7.2, 3.3)
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            _draw(axes, study)
            axes.set_xlabel(axis_label(criterion.name, criterion.unit))
            axes.locator_params(axis="x", nbins=6)
        left.set_ylabel("power [W]")
        values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
        left.set_xlim(values[0] - 0.03 * np.ptp(values), values[-1] + 0.03 * np.ptp(values))
        left.set_ylim(0.0, powers[-1] * 1.06)
        end = knees[0].value + 0.08 * np.ptp(values) if knees else values[0] + 0.5 * np.ptp(values)
        top = float(np.interp(end, values, powers))
        right.set_xlim(values[0] - 0.03 * (end - values[0]), end)
        right.set_ylim(powers[0] - 0.08 * (top - powers[0]), top)
        right.set_title("the front's cheap part", loc="left")
        demanded = criterion.demanded(problem)
        if values[0] < demanded < values[-1]:
            for axes in (left, right):
                axes.axvline(
                    demanded, color="0.6", linestyle=":", linewidth=1.0, label="demanded in the paper's problem"
                )
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        figure.set_figheight(3.3 + 0.19 * -(-len(labels) // 2))
    return figure


def _draw(axes: Axes, study: ParetoStudy) -> None:
    searches, knees = study.searches, study.bends.knees
    budgets = sorted({f.budget for f in searches})
    for algorithm, budget in sorted({(f.algorithm, f.budget) for f in searches}):
        chosen = [f for f in searches if (f.algorithm, f.budget) == (algorithm, budget)]
        values, powers = (np.concatenate([getattr(f, key) for f in chosen]) for key in ("values", "powers"))
        axes.plot(
            values,
            powers,
            MARKS[budgets.index(budget) % len(MARKS)],
            color=SEARCH_COLOURS[algorithm],
            markersize=2.5,
            markeredgewidth=0.5,
            alpha=0.45,
            label=f"{SEARCH_NAMES[algorithm]}, {budget:,} evaluations, {len(chosen)} runs",
            rasterized=True,
        )
    line = [(p.value, p.power_W) for p in study.front]
    axes.plot(*zip(*line, strict=True), "-", color=COLOURS["ipopt"], label=f"IPOPT, {len(line)} points")
    if knees:
        axes.plot(
            [k.value for k in knees],
            [k.power_W for k in knees],
            "o",
            color="none",
            markeredgecolor=COLOURS["aco"],
            markersize=9,
            markeredgewidth=1.6,
            label="knee",
        )
