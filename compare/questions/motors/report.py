"""The motors' variants as an answer: tables and picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.drawing.figures import add_legend_below, new_figure, style
from compare.drawing.labels import axis_label, name_in_words, units_of
from compare.questions.answer import Answer, all_digits, optima_table, table_of
from compare.questions.motors.study import Variant
from compare.report.document import Figure, Table, Value, text_table
from nlp_gait.formulation import GaitProblem

STILL = 1e-4  # of a variable's range


def motors_answer(found: Sequence[Variant], problem: GaitProblem) -> Answer:
    """What each feature of the motors changes.

    Args:
        found: the first is the published one.
        problem: as published.
    """
    stem = f"{problem.name}-motors"
    kinds = tuple(found[0].uses)
    uses = [
        (v.name, *(f"{v.uses[kind].share:.1%} {v.uses[kind].row.partition('[')[2][:-1]}" for kind in kinds))
        for v in found
    ]
    largest = "Largest share of each limit that the optimum uses: joint, sample"
    shown = "Power at the optimum and at the published one; where x* lies in its ranges."
    return Answer(
        stem=stem,
        title=f"{problem.name} with real motors",
        parts=(
            table_of(
                "What each feature changes",
                found,
                {
                    "motors": lambda v: v.name,
                    "optimum [W]": lambda v: f"{v.power_W:.6f}",
                    "published x* [W]": lambda v: (
                        f"{v.unchanged_power_W:.6f}" + (" (breaks limits)" if v.unchanged_violation > 0.0 else "")
                    ),
                    "optimum's power as published [W]": lambda v: f"{v.published_power_W:.6f}",
                    "x* moves most in": lambda v: (
                        "-" if v.moved[0] < STILL else f"{v.moved[1]} by {v.moved[0]:.0%} of its range"
                    ),
                },
            ),
            text_table(("motors", *kinds), uses, largest),
            optima_table({v.name: v.x for v in found}),
            Figure(name=stem, caption=shown, drawing=motors_figure(found, problem)),
            _numbers(stem, found),
        ),
        data={"problem": problem.name, "variants": [asdict(variant) for variant in found]},
    )


def _numbers(stem: str, found: Sequence[Variant]) -> Table:
    names, kinds = list(found[0].x), list(found[0].uses)
    header = [
        *("variant", "motors", "power_W", "power_at_published_x_W", "violation_of_published_x", "power_as_published_W"),
        *(*names, *(f"share_of_{kind.replace(' ', '_')}" for kind in kinds), "success", "status"),
    ]
    rows: list[list[Value]] = [
        [
            *(v.name, v.features, v.power_W, v.unchanged_power_W, v.unchanged_violation, v.published_power_W),
            *v.x.values(),
            *(v.uses[kind].share for kind in kinds),
            *(v.success, v.status),
        ]
        for v in found
    ]
    return all_digits(stem, header, rows)


def motors_figure(found: Sequence[Variant], problem: GaitProblem) -> Drawing:
    """Left: power at the optimum and at the published one. Right: where x* lies in its ranges."""
    places = np.arange(len(found))
    with style():
        figure = new_figure(7.6, 0.9 + 0.34 * len(found))
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
        left.barh(places - 0.19, [v.unchanged_power_W for v in found], 0.36, color="0.75", label="at the published x*")
        left.barh(places + 0.19, [v.power_W for v in found], 0.36, color="#0072B2", label="at the optimum")
        left.set_yticks(places, [v.name for v in found])
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlabel(axis_label("power", "W"))
        add_legend_below(figure)
        shares = np.array([(np.array(list(v.x.values())) - problem.lower) / problem.scale for v in found])
        image = right.imshow(shares, aspect="auto", cmap="viridis", vmin=0.0, vmax=1.0)
        units = units_of(problem)
        words = [name_in_words(name, units[name]) for name in problem.names]
        right.set_xticks(range(len(words)), words, rotation=40, ha="right")
        right.set_yticks([])
        right.grid(visible=False)
        figure.colorbar(image, ax=right, label="x* from lower to upper bound")
    return figure
