"""Robust optima as an answer: tables and picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import millimetres
from compare.drawing.figures import add_legend_below, new_figure, style
from compare.questions.answer import Answer, all_digits, optima_table, table_of
from compare.questions.other_robot import is_mass
from compare.questions.robust.family import Worst
from compare.questions.robust.playback import Played
from compare.questions.robust.study import Robust
from compare.report.document import Figure, Table, Value

NOMINAL, ROBUST, WORST = "0.72", "#0072B2", "#D55E00"
LISTED = 4  # links with another mass that are named in a table


def robust_answer(problem: str, found: Sequence[Robust], runs: Sequence[Played]) -> Answer:
    """What robustness costs.

    Args:
        problem: its name.
        found: one for each box, the widest last.
        runs: of the widest box in the physics engine; none if it was not asked for.
    """
    stem = f"{problem}-robust"
    shown = "Power with the nominal robot and in the worst corner" + (
        "; lateral margins in model and engine" * bool(runs)
    )
    return Answer(
        stem=stem,
        title=f"{problem}: price of robustness",
        verdict=(f"{found[0].nominal_W:.6f} W for the nominal robot; {_width(found[-1].box)}",),
        parts=(
            _prices(found),
            *(
                f"{r.name}: worst for the nominal gait with {_changes(r.nominal_worst.corner)}"
                for r in found
                if r.nominal_worst.violation > 0.0
            ),
            optima_table({"nominal": found[0].nominal_x, **{r.name: r.x for r in found}}),
            *([_played(found[-1], runs)] if runs else ()),
            Figure(name=stem, caption=shown, drawing=robust_figure(found, runs)),
            _numbers(stem, found),
        ),
        data={"problem": problem, "boxes": [asdict(r) for r in found], "played": [asdict(run) for run in runs]},
    )


def _prices(found: Sequence[Robust]) -> Table:
    return table_of(
        "Price of robustness",
        found,
        {
            "uncertain": lambda r: r.name,
            "nominal gait breaks": lambda r: _violation(r.nominal_worst),
            "robust gait, nominal robot": lambda r: f"{r.power_W:.6f} W",
            "price": lambda r: f"{r.power_W - r.nominal_W:+z.6f} W, {r.power_W / r.nominal_W - 1.0:+z.2%}",
            "worst corner": lambda r: f"{r.worst_W:.6f} W",
            "robust gait breaks: scenarios": lambda r: _violation(r.worst),
            "random corners": lambda r: _violation(r.random_worst),
            "scenarios": lambda r: f"{len(r.corners)}" + ("" if r.settled else ", not settled"),
        },
    )


def _played(widest: Robust, runs: Sequence[Played]) -> Table:
    return table_of(
        f"Played open loop on the robots of the last box ({widest.name})",
        runs,
        {
            "gait": lambda run: run.gait,
            "robot": lambda run: _changes(widest.corners[widest.robots.index(run.robot)]),
            "in MuJoCo": lambda run: "stays up" if run.fell_at_s is None else f"FALLS at {run.fell_at_s:.2f} s",
            "largest tilt": lambda run: f"{run.largest_tilt_deg:.1f} degrees",
            "mean lateral margin: model": lambda run: millimetres(run.predicted_margin_m),
            "MuJoCo": lambda run: millimetres(run.margin_m),
        },
    )


def _numbers(stem: str, found: Sequence[Robust]) -> Table:
    header = [
        *("uncertain", "scenarios", "nominal_W", "violation_of_nominal", "unit", "row", "robust_W", "robust_worst_W"),
        *("violation_of_robust", "violation_of_robust_in_random_corners", *found[0].x, "settled"),
    ]
    rows: list[list[Value]] = [
        [
            *(r.name, len(r.corners), r.nominal_W, r.nominal_worst.violation, r.nominal_worst.unit),
            *(r.nominal_worst.row, r.power_W, r.worst_W, r.worst.violation, r.random_worst.violation),
            *(*r.x.values(), r.settled),
        ]
        for r in found
    ]
    return all_digits(stem, header, rows)


def robust_figure(found: Sequence[Robust], runs: Sequence[Played]) -> Drawing:
    """Left: power with the nominal robot and in the worst corner. Right: lateral margins in model and engine, if played."""
    nominal = found[0].nominal_W
    names = ["none", *(r.name for r in found)]
    places = np.arange(len(names))
    with style():
        figure = new_figure(7.2 if runs else 4.2, 2.7)
        grid = figure.subplots(1, 2 if runs else 1, squeeze=False, width_ratios=(1.15, 1.0) if runs else None)
        left, *others = grid[0]
        left.barh(places - 0.19, [nominal, *(r.power_W for r in found)], 0.36, color=ROBUST, label="nominal robot")
        left.barh(places + 0.19, [nominal, *(r.worst_W for r in found)], 0.36, color=WORST, label="worst corner")
        left.set_yticks(places, names)
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlim(left=0.8 * nominal)
        left.set_xlabel("power [W], axis cut off")
        left.set_title("uncertain")
        add_legend_below(figure)
        for axes in others:
            for gait, colour, marker in (("nominal", NOMINAL, "s"), ("robust", ROBUST, "o")):
                own = [run for run in runs if run.gait == gait]
                at = [1000 * run.predicted_margin_m for run in own], [1000 * run.margin_m for run in own]
                axes.plot(*at, marker, color=colour, label=f"{gait} gait")
            low, high = axes.get_xlim()
            axes.plot((low, high), (low, high), color="0.4", linewidth=0.6)
            axes.set_xlabel("mean lateral margin in the model [mm]")
            axes.set_ylabel("in MuJoCo [mm]")
            axes.legend()
    return figure


def _violation(worst: Worst) -> str:
    return f"{worst.row} by {worst.violation:.3g} {worst.unit}" if worst.violation > 0.0 else "nothing"


def _width(box: Mapping[str, float]) -> str:
    """Half-widths of a box in words."""
    masses = [half for name, half in box.items() if is_mass(name)]
    soles = f"soles +-{1000 * max(half for name, half in box.items() if not is_mass(name)):g} mm"
    return f"masses +-{100 * max(masses):g} %, {soles}" if masses else soles


def _changes(corner: Mapping[str, float]) -> str:
    """Changes of a robot in words."""
    if not corner:
        return "no change"
    parts = [f"{name.removesuffix('_m')} {1000 * by:+g} mm" for name, by in corner.items() if not is_mass(name)]
    for sign in (1, -1):
        changed = {name.removesuffix(".mass"): by for name, by in corner.items() if is_mass(name) and sign * by > 0.0}
        if changed:
            names = sorted(changed)
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            parts.append(f"{sign * max(map(abs, changed.values())):+.0%} {', '.join(names[:LISTED])}{more}")
    return "; ".join(parts)
