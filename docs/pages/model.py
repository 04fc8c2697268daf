"""What the pages of the model include: drawings of the sole and of its margin, counts of constraints, cost of smoothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from compare.drawing.figures import INK, make_figure, render_svg, use_style
from docs.pages.markdown import code, page, table, write_all
from docs.pages.problems import names
from nlp_gait.backends.nlp import WIDTHS
from nlp_gait.formulation import load
from nlp_gait.gaits.biped.limits import GOALS
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.leg_network import ONLINE, PRINTED
from nlp_gait.robots import load_robot
from nlp_gait.symbolic.nonsmooth import Exact

MEASURED = Path(__file__).parents[1] / "smoothing.json"
ROBOT = "nao-v5"
BLUE, ORANGE = "#0072B2", "#D55E00"


def write(folder: Path) -> None:
    """Write drawings and tables."""
    own = folder / "model"
    pages = {
        "counts": count_constraints,
        "levels": list_levels,
        "objectives": list_objectives,
        "stairs": list_stair_constants,
    }
    write_all(own, {f"{name}.md": make() for name, make in pages.items()})
    for name, drawing in (("sole", draw_sole()), ("smoothed-margin", draw_smoothed_margin())):
        (own / f"{name}.svg").write_text(render_svg(drawing), encoding="utf-8")


def count_constraints() -> str:
    """Return the number of rows of each family, a line for each problem."""
    rows = []
    for name in names():
        problem = load(name)
        counts: dict[str, int] = {}
        for constraint in problem.assemble(problem.symbols(), Exact()).constraints:
            counts[constraint.name] = counts.get(constraint.name, 0) + constraint.value.shape[0]
        families = ", ".join(f"{code(family)} {count:,}" for family, count in counts.items())
        rows.append((f"[`{name}`](../generated/problems/{name}.md)", f"{sum(counts.values()):,}", families))
    return page(table(("problem", "rows", "of each family"), rows))


def list_levels() -> str:
    """Return the table of widths, as ``docs.smoothing`` measured it."""
    measured = json.loads(MEASURED.read_text(encoding="utf-8"))
    header = (
        "mean margin in x [mm]",
        "width $w$ [mm]",
        "10 % to 90 % within [mm]",
        "optimal power [W]",
        "difference [mW]",
        "exact violation",
        "iterations",
    )
    rows = [
        (
            f"{1000 * row['margin_m']:g}",
            f"{1000 * row['width_m']:g}",
            f"{1000 * 2 * np.log(9.0) * row['width_m']:.3g}",
            f"{row['power_W']:.6f}",
            f"{1000 * row['more_W']:+.4f}",
            f"{row['violation']:.1e}",
            str(row["iterations"]),
        )
        for row in measured
    ]
    return page(table(header, rows))


def list_objectives() -> str:
    """Return the formulas of all objectives of a phase but power."""
    rows = [
        (code(f"objective={name}"), f"${goal.formula}$", goal.objective.unit)
        for name, goal in GOALS.items()
        if goal.formula
    ]
    return page(table(("option", "formula", "unit"), rows))


def list_stair_constants() -> str:
    """Return the constants of the stairs paper's closed loop and network."""
    problem = load("stairs-track")
    rows = [("Δt", f"{QUANTUM:g}", "s", "quantum of time")]
    shown = ("ground_stiffness_N_m", "ground_damping_N_s_m", "friction", "disturbance_Nm", "zmp_weight")
    for parameter in problem.parameters:
        if parameter.name in shown:
            value = f"{problem.value(parameter.name):.4g}"
            rows.append((code(parameter.name), value, parameter.unit, parameter.description))
    for words, network in (("as printed", PRINTED), ("within a search", ONLINE)):
        rows.append(
            (
                f"α, {words}",
                f"{network.rate:g}",
                "1",
                f"at most {network.iterations} steps, {network.hidden} hidden nodes",
            )
        )
    return page(table(("constant", "value", "unit", "meaning"), rows))


def draw_sole() -> Any:
    """Draw a sole from above with the margins of two points."""
    foot = load_robot(ROBOT).feet["left"]
    back, front, left, right = (1000 * v for v in (foot.back_m, foot.front_m, foot.left_m, foot.right_m))
    with use_style():
        figure = make_figure(6.3, 3.6)
        axes = figure.subplots()
        axes.plot([-back, front, front, -back, -back], [-right, -right, left, left, -right], color=INK)
        axes.plot(0, 0, "o", color=INK)
        axes.annotate("ankle", (0, 0), (2, 2))
        axes.axvline(0, color="#909090", ls=":", lw=1)
        for x, y, edge, colour, words in ((-18, -12, -back, ORANGE, "behind"), (35, 12, front, BLUE, "ahead of")):
            side = left if y > 0 else -right
            axes.plot(x, y, "X", color=colour, ms=8)
            axes.annotate(f"ZMP {words} the ankle", (x, y), (x - 4, y + (4 if y < 0 else -7)), color=colour)
            axes.annotate("", (edge, y), (x, y), arrowprops={"arrowstyle": "<->", "color": colour})
            axes.annotate(r"$m_x$", ((x + edge) / 2, y + 1.5), color=colour)
            axes.annotate("", (x, side), (x, y), arrowprops={"arrowstyle": "<->", "color": colour})
            axes.annotate(r"$m_y$", (x + 1, (y + side) / 2), color=colour)
        axes.set(
            xlabel="x [mm], forward", ylabel="y [mm], left", aspect="equal", title=f"Left sole of {ROBOT} from above"
        )
        axes.grid(visible=False)
    return figure


def draw_smoothed_margin() -> Any:
    """Draw the margin in x over the ZMP, exact and at both widths of the solver."""
    foot = load_robot(ROBOT).feet["left"]
    z = np.linspace(-foot.back_m, foot.front_m, 1501)
    with use_style():
        figure = make_figure(6.3, 3.0)
        axes = figure.subplots()
        jump = foot.front_m - foot.back_m - 2 * z
        for width, colour in zip(WIDTHS, (ORANGE, BLUE), strict=True):
            share = 0.5 * (1 + np.tanh(z / (2 * width)))
            axes.plot(1000 * z, 1000 * (z + foot.back_m + share * jump), color=colour, label=f"w = {1000 * width:g} mm")
        exact = np.where(z < 0, z + foot.back_m, foot.front_m - z)
        exact[np.searchsorted(z, 0.0)] = np.nan
        axes.plot(1000 * z, 1000 * exact, color=INK, ls="--", label="exact")
        axes.set(xlabel="ZMP ahead of the ankle [mm]", ylabel="margin in x [mm]")
        axes.legend()
    return figure
