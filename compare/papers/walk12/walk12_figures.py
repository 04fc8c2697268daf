"""Figures 8 to 10 and 12 to 17 of the paper on the 12-joint walk as the model gives them, the trade-off and a circle."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.drawing.figures import COLOURS, make_axes, make_figure
from compare.papers.paper_runs import get_point
from compare.papers.walk12.walk12_findings import Walk12Findings, follow
from compare.papers.walk12.walk12_paper import find_row
from compare.papers.walk12.walk12_runs import GA, PAPER, PathPoint
from compare.study.record import RunRecord
from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER_COLOUR = "#E69F00"
MILLIMETRES = 1e3
FIGURE_9 = ((1, 12), (2, 11), (3, 10))
FIGURE_10 = ((4, 9), (5, 8), (6, 7))
ZMP_FIGURES = {"fig12-13": 0.15, "fig14-15": 1.0, "fig16-17": 0.1}
TURN_RAD = math.radians(8.0)  # the largest that the paper allows
TURNING_WEIGHT = 0.9  # on circles the paper keeps lambda >= 0.7


def draw_figures(findings: Walk12Findings) -> dict[str, Figure]:
    """Return the figures by name."""
    gaits = _list_gaits(findings, 0.15)
    return {
        "fig08": _draw_fitness(findings.records(PAPER, 0.15, "ga"), findings.optimum(PAPER, 0.15)),
        "fig09": _draw_angles(gaits, FIGURE_9),
        "fig10": _draw_angles(gaits, FIGURE_10),
        **{name: _draw_zmp(_list_gaits(findings, weight)) for name, weight in ZMP_FIGURES.items()},
        "tradeoff": _draw_tradeoff(findings.front, findings.weighted),
        "circle": _draw_circle(get_point(findings.optimum(PAPER, TURNING_WEIGHT)), TURN_RAD),
    }


def _list_gaits(findings: Walk12Findings, weight: float) -> dict[str, Sequence[float]]:
    return {"paper's gait": find_row(weight).x, "IPOPT": get_point(findings.optimum(PAPER, weight))}


def _choose_colour(label: str) -> str:
    return PAPER_COLOUR if label.startswith("paper") else COLOURS["ipopt"]


def _draw_fitness(ga: Sequence[RunRecord], optimum: RunRecord) -> Figure:
    figure, axes = make_axes(4.2, 2.8)
    runs = np.array([run.history.objective for run in ga], dtype=float)
    epochs = np.arange(runs.shape[1])
    paint = dict[str, Any](where="post", color=COLOURS["ga"])
    axes.step(epochs, runs.T, **paint, alpha=0.3, linewidth=0.8)
    axes.step(epochs, np.median(runs, axis=0), **paint, label=f"GA, median of {len(runs)} runs")
    axes.axhline(optimum.verdict.objective, color=COLOURS["ipopt"], linestyle="--", label="IPOPT")
    axes.axvline(15, color="0.5", linewidth=0.8, linestyle=":", label="the paper: converged")
    axes.set(xlabel=f"epoch ({GA.population} evaluations each)", ylabel="best f so far [1]")
    axes.legend(loc="lower right")
    return figure


def _draw_angles(gaits: Mapping[str, Sequence[float]], pairs: Sequence[tuple[int, int]]) -> Figure:
    figure = make_figure(6.3, 5.2)
    grid = figure.subplots(len(pairs), 2, sharex=True, squeeze=False)
    for label, x in gaits.items():
        arrays = follow(x, steps=10, intervals=40)
        for row, pair in zip(grid, pairs, strict=True):
            for axes, joint in zip(row, pair, strict=True):
                degrees = np.degrees(arrays["q"][:, joint - 1])
                axes.plot(arrays["t"], degrees, color=_choose_colour(label), label=label, linewidth=1.0)
                axes.set(ylabel=rf"$\theta_{{{joint}}}$ [deg]")
                if not degrees.any():  # else noise would fill the axes
                    axes.set_ylim(-1.0, 1.0)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _draw_zmp(gaits: Mapping[str, Sequence[float]]) -> Figure:
    from matplotlib.patches import Rectangle

    figure = make_figure(6.3, 3.0)
    plane, time = figure.subplots(1, 2)
    robot = load_point_mass_biped()
    back, front, width = (MILLIMETRES * m for m in (robot.foot_back_m, robot.foot_front_m, robot.foot_width_m))
    sole: dict[str, Any] = {"facecolor": "#d9e6f2", "edgecolor": "0.4", "linewidth": 0.8}
    plane.add_patch(Rectangle((-back, -width / 2), back + front, width, **sole))
    plane.plot(0, 0, color="0.4", marker="+")
    for label, x in gaits.items():
        arrays = follow(x, steps=1, intervals=400)
        zmp = MILLIMETRES * arrays["zmp_foot"]
        colour = _choose_colour(label)
        plane.plot(zmp[:, 0], zmp[:, 1], color=colour, label=label)
        plane.plot(*zmp[0], color=colour, marker="o")
        time.plot(arrays["t"], zmp[:, 0], color=colour, linestyle=":", label=f"x, {label}")
        time.plot(arrays["t"], zmp[:, 1], color=colour, label=f"y, {label}")
    plane.set(xlabel="x of the ZMP [mm]", ylabel="y of the ZMP [mm]", aspect="equal")
    plane.set_xlim(-50, 80)
    plane.legend(loc="upper left", bbox_to_anchor=(0.0, 1.22), ncols=2)
    time.set(xlabel="time [s]", ylabel="ZMP from the stance ankle [mm]")
    time.legend(loc="upper left", bbox_to_anchor=(0.0, 1.22), ncols=2)
    return figure


def _draw_tradeoff(front: Sequence[PathPoint], weighted: Sequence[PathPoint]) -> Figure:

    def plane_of(path: Sequence[PathPoint]) -> tuple[list[float], list[float]]:
        return [MILLIMETRES * at.step_length_m for at in path], [1e3 * at.Q_m2s for at in path]

    figure = make_figure(6.3, 3.0)
    plane, sweep = figure.subplots(1, 2)
    plane.plot(*plane_of(front), color=COLOURS["pso"], label="Pareto front")
    points = [at for at in weighted if at.at > 0.0]  # at zero Q does not count
    s, Q = plane_of(points)
    plane.plot(s, Q, "o", color=COLOURS["ga"], fillstyle="none", label="weighted sum")
    for end, offset, align in ((min(s), (12, -4), "left"), (max(s), (-8, -2), "right")):
        here = [k for k, length in enumerate(s) if abs(length - end) < 0.01]
        text = rf"$\lambda$ = {points[here[0]].at:.3g} to {points[here[-1]].at:.3g}"
        at = (end, Q[here[0]])
        plane.annotate(text, at, xytext=offset, textcoords="offset points", ha=align, fontsize=8)
    plane.set(xlabel="step length s [mm]", ylabel=r"Q [$10^{-3}$ m$^2$ s]")
    plane.legend(loc="center left", bbox_to_anchor=(0.0, 0.7))
    sweep.plot([at.at for at in weighted], plane_of(weighted)[0], color=COLOURS["ga"])
    sweep.set(xlabel=r"$\lambda$ [1]", ylabel="optimal step length s [mm]")
    return figure


def _draw_circle(x: Sequence[float], turn_rad: float) -> Figure:
    arrays = follow(x, steps=int(np.ceil(2 * np.pi / turn_rad)), intervals=20, turn_rad=turn_rad)
    figure, axes = make_axes(3.6, 3.4)
    axes.plot(*arrays["waist"][:, :2].T, color="0.5", linewidth=0.8, label="waist")
    for side, stance, colour in (("left", 1.0, COLOURS["pso"]), ("right", 0.0, COLOURS["ga"])):
        prints = np.unique(np.round(arrays[f"{side}_ankle"][arrays["left_stance"] == stance], 9), axis=0)
        axes.plot(prints[:, 0], prints[:, 1], "s", markersize=3, color=colour, label=f"{side} foot")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.legend(loc="center")
    return figure
