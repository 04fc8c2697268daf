"""Figures about NAO's walk: energy by joint, cost over speed, softer drives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from compare.drawing.figures import COLOURS, new_figure
from compare.papers.nao_walk.nao_walk_claims import NaoWalkFindings
from compare.papers.nao_walk.nao_walk_runs import KINDS, SPEED_M_S

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BARS = (  # gait, where, label
    ("own", "model", "own walk,\nmodel"),
    ("own", "engine", "own walk,\nengine"),
    ("own-plain", "engine", "plain drives,\nengine"),
    ("optimum-sheet", "model", "optimum,\nmodel"),
    ("optimum-sheet", "engine", "optimum,\nengine"),
)
PALETTE = ("#D55E00", "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#999999")


def draw_figures(findings: NaoWalkFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    return {"joints": _draw_joints(findings), "speeds": _draw_speeds(findings), "drives": _draw_drives(findings)}


def _draw_joints(findings: NaoWalkFindings) -> Figure:
    """Energy by kind of joint; full colour is heat, pale is mechanical."""
    figure = new_figure(6.3, 3.4)
    axes = figure.subplots()
    for place, (gait, where, _) in enumerate(BARS):
        bottom = 0.0
        for kind, colour in zip(KINDS, PALETTE, strict=True):
            energies = findings.joints[gait][where][kind]
            axes.bar(place, energies["sheet"], 0.7, bottom, color=colour, label=None if place else KINDS[kind])
            bottom += energies["sheet"]
            axes.bar(place, energies["mechanical"], 0.7, bottom, color=colour, alpha=0.45)
            bottom += energies["mechanical"]
    axes.set_axisbelow(True)
    axes.set_xticks(range(len(BARS)), [label for *_, label in BARS])
    axes.set_ylabel("energy [J/m]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    return figure


def _draw_speeds(findings: NaoWalkFindings) -> Figure:
    """Cost of transport over speed, and the default speed."""
    figure = new_figure(4.6, 3.0)
    axes = figure.subplots()
    for heat, name, colour in (("paper", "paper", COLOURS["pso"]), ("sheet", "data sheet", COLOURS["ga"])):
        curve = findings.curve(heat)
        speeds, costs = [100.0 * at["speed_m_s"] for at in curve], [at["cost_of_transport"] for at in curve]
        axes.plot(speeds, costs, "o-", color=colour, label=f"optimum, K of the {name}")
    axes.axvline(100.0 * SPEED_M_S, color="#808080", ls="--", label="default speed")
    axes.set(xlabel="speed [cm/s]", ylabel="cost of transport P / (m g v)")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return figure


def _draw_drives(findings: NaoWalkFindings) -> Figure:
    """Energy, falls and largest speed of the robot's own walk over the stiffness of its drives."""
    figure = new_figure(6.3, 2.8)
    energy, falls, speed = figure.subplots(1, 3)
    shares = findings.effort.stiffnesses
    for name, label, colour in (("none", "plain", COLOURS["ga"]), ("torque", "torque fed forward", COLOURS["pso"])):
        points = findings.drives[name]
        up = [(share, point["sheet_J_per_m"]) for share, point in zip(shares, points, strict=True) if not point["fell"]]
        if up:
            energy.plot(*zip(*up, strict=True), "o-", color=colour, label=label)
        falls.plot(shares, [point["falls"] for point in points], "o-", color=colour)
        speed.plot(shares, [100.0 * point["fastest_m_s"] for point in points], "o-", color=colour)
    energy.set_ylabel("energy [J/m]")
    falls.set_ylabel(f"falls of {findings.drives['none'][0]['disturbances']}")
    speed.set_ylabel("fastest walk [cm/s]")
    for axes in (energy, falls, speed):
        axes.set_ylim(0.0, 1.05 * axes.dataLim.y1 or 1.0)
        axes.set_xlabel("stiffness, share of full")
    energy.legend()
    return figure
