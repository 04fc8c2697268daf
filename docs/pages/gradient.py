"""Figures and tables of the page on gradients and searches, from ``docs/landscape.json`` (``python -m docs.landscape``)."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context

from compare.analysis.units import make_heading, name_in_words
from compare.drawing.figures import COLOURS, INK, make_figure, render_svg, use_style
from docs.pages.markdown import page, table, write_all

MEASURED = Path(__file__).parents[1] / "landscape.json"
SEARCHES = ("pso", "ga", "aco")
BESIDE = (*SEARCHES, "cma", "ipopt")
STILL = 1e-6  # share of a range: a particle that moves less is at rest
LEAST = 1e-9  # gaps below are drawn here
GRADIENT_WITHOUT_MODEL = "slsqp, finite differences"


def write(folder: Path) -> None:
    """Write drawings and tables."""
    own, data = folder / "gradient", json.loads(MEASURED.read_text(encoding="utf-8"))
    write_all(own, {"rest.md": describe_rest(data), "budget.md": list_budgets(data), "noise.md": list_noises(data)})
    drawings = {
        "landscape": draw_landscape(data),
        "ridge": draw_ridge(data),
        "moves": draw_moves(data),
        "dimension": draw_dimensions(data),
    }
    for name, drawing in drawings.items():
        (own / f"{name}.svg").write_text(render_svg(drawing), encoding="utf-8")


def format_gap(gap: float | None) -> str:
    """Return a gap in percent with two digits."""
    if gap is None or not math.isfinite(gap):
        return "infeasible"
    return "below 0.0001 %" if gap < 1e-6 else f"{100 * gap:.2g} %"


def describe_rest(data: dict[str, Any]) -> str:
    """Return when PSO's particles come to rest, and where."""
    moves = data["searches"]["pso"]["moves"]
    rest = next(k for k in range(len(moves)) if all(move < STILL for move in moves[k:]))
    gap = data["searches"]["pso"]["path"][-1][2]
    share = 100 * (rest + 1) / len(moves)
    return page(
        f"From generation {rest + 1} on, after {share:.0f} % of {data['budget']:,} evaluations, half of PSO's particles move by "
        f"less than a millionth of each range. The swarm has not converged to the optimum: it rests {format_gap(gap)} above it."
    )


def list_budgets(data: dict[str, Any]) -> str:
    """Return the table of the gaps after each budget."""
    rows = [(name, *(format_gap(gap) for gap in data["searches"][name]["gap"].values())) for name in SEARCHES]
    budgets = [f"{int(budget):,}" for budget in data["searches"][SEARCHES[0]]["gap"]]
    return page(table(("search", *(f"after {budget}" for budget in budgets)), rows))


def list_noises(data: dict[str, Any]) -> str:
    """Return the table of true gaps under noise."""
    names = [*SEARCHES, "cma", "slsqp"]
    shown = {"slsqp": GRADIENT_WITHOUT_MODEL}
    rows = [
        ("none" if not row["noise"] else f"{row['noise']:.0e}", *(format_gap(row[name]) for name in names))
        for row in data["noise"]
    ]
    return page(table(("noise", *(shown.get(name, name) for name in names)), rows))


def draw_landscape(data: dict[str, Any]) -> Any:
    """Draw the power in two variables, where gaits are feasible, and the paths of the solvers."""
    plane, (first, second) = data["plane"], data["pair"]
    x, y = (1000 * np.array(side) for side in plane["sides"])
    power, violation = np.array(plane["power_W"]), np.array(plane["violation"])
    with use_style(), rc_context({"hatch.color": "#a0a0a0", "hatch.linewidth": 0.5}):
        figure = make_figure(6.6, 4.6)
        axes = figure.subplots()
        box = (x[0], x[-1], y[0], y[-1])
        image = axes.imshow(power, origin="lower", extent=box, cmap="Greys", aspect="auto", alpha=0.75)
        figure.colorbar(image, ax=axes, label="power [W]")
        axes.contourf(x, y, violation > 0.0, levels=[0.5, 1.5], colors="none", hatches=["////"])
        for name in SEARCHES:
            path = 1000 * np.array([point[:2] for point in data["searches"][name]["path"]])
            axes.plot(*path.T, ".-", color=COLOURS[name], ms=3, lw=0.8, label=name)
        path = 1000 * np.array([point[:2] for point in data["ipopt"]])
        axes.plot(*path.T, "o-", color=COLOURS["ipopt"], ms=4, lw=1.4, label="ipopt")
        axes.plot(*(1000 * np.array(plane["optimum"])), "*", color="#D00000", ms=13, label="optimum")
        axes.set(xlim=box[:2], ylim=box[2:])
        axes.set(
            xlabel=make_heading(name_in_words(first, "m/s"), "mm/s"),
            ylabel=make_heading(name_in_words(second, "m/s"), "mm/s"),
        )
        axes.grid(visible=False)
        figure.legend(loc="outside upper center", ncols=5)
    return figure


def draw_ridge(data: dict[str, Any]) -> Any:
    """Draw power and violation along a line across the limit of the sway."""
    cut, second = data["plane"]["cut"], data["pair"][1]
    at, centre = 1000 * np.array(cut["at"]), 1000 * data["plane"]["optimum"][1]
    power, violation = np.array(cut["power_W"]), np.array(cut["violation"])
    with use_style():
        figure = make_figure(6.3, 3.4)
        upper, lower = figure.subplots(2, 1, sharex=True)
        upper.plot(at, power, color=COLOURS["pso"])
        upper.plot(centre, data["power_W"], "*", color="#D00000", ms=12)
        upper.set_ylabel("power [W]")
        lower.plot(at, violation, color=COLOURS["ga"])
        lower.set(xlabel=make_heading(name_in_words(second, "m/s"), "mm/s"), ylabel="violation")
        for axes in (upper, lower):
            axes.axvspan(centre, at[-1], color=INK, alpha=0.12, lw=0)
    return figure


def draw_moves(data: dict[str, Any]) -> Any:
    """Draw how far the candidates move from one generation to the next."""
    with use_style():
        figure = make_figure(6.3, 2.8)
        axes = figure.subplots()
        for name in SEARCHES:
            moves = np.array(data["searches"][name]["moves"])
            evaluations = np.linspace(0, data["budget"], len(moves) + 1)[1:]
            axes.semilogy(evaluations, np.maximum(moves, LEAST), color=COLOURS[name], lw=1.0, label=name)
        axes.set(xlabel="evaluations", ylabel="median move\n[share of range]", ylim=(LEAST, 1.0))
        axes.legend()
    return figure


def draw_dimensions(data: dict[str, Any]) -> Any:
    """Draw the median gap of every instance of GaitBench over its number of variables."""
    with use_style():
        figure = make_figure(6.3, 3.4)
        axes = figure.subplots()
        for name in BESIDE:
            found = [(row["n"], row[name]) for row in data["dimensions"] if row.get(name) is not None]
            n, gaps = np.array(found).T
            axes.loglog(n, np.maximum(gaps, LEAST), "o", color=COLOURS[name], ms=4, alpha=0.8, label=name)
        axes.set(xlabel="variables", ylabel="median gap after 10,000 evaluations")
        figure.legend(loc="outside right upper")
    return figure
