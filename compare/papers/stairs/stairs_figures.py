"""Figures 3 and 6 to 29 of the stairs paper, from our plans and rollouts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from compare.drawing.figures import add_legend_below, make_axes, make_figure
from compare.papers.paper_runs import get_point
from compare.papers.stairs.stairs_paper import TABLE_4
from compare.papers.stairs.stairs_planning import move
from compare.papers.stairs.stairs_runs import DRAWN_CASE, StairsFindings, roll_out
from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.closed_loop import ANGLES, measure_joints
from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped
from nlp_gait.gaits.stairs.stair import SETBACK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STICKS = 29  # poses of a drawn step
LIGHT, DARK = np.array([[0.75, 0.85, 0.95], [0.0, 0.45, 0.7]])  # blue, of the first and the last pose
TRACKED_LINKS = LINKS[:7]  # q1 to q7
# From joint angles to those of the paper, of which knees are relative (27), (28); of rows.
PRINTED_ANGLES = (measure_joints("printed") @ ca.inv(measure_joints("joint"))).full().T


def draw_figures(findings: StairsFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    plans = {case: findings.plan(case) for case in findings.cases}
    followed = {case: roll_out(case, plans[case], get_point(findings.best_track(case))) for case in findings.cases}
    jerk, step = findings.plan(DRAWN_CASE, "jerk"), TABLE_4[DRAWN_CASE].step_m
    signals, _ = move(findings, "jerk", DRAWN_CASE)
    return {
        "fig03": _draw_segments(signals.arrays, jerk, step),
        "fig06-07": _draw_sticks(move(findings, "first", DRAWN_CASE), step, "first step"),
        "fig08-09": _draw_sticks(move(findings, "landing", DRAWN_CASE), step, "next step"),
        "fig10-11": _draw_ankle(signals.arrays),
        "fig12": _draw_stairs_compared(findings),
        "fig13": _draw_pose_times(findings.others["network"], findings.cases[0]),
        "fig14-20": _draw_tracking(followed, "q", "angle [rad]"),
        "fig21-27": _draw_tracking(followed, "qd", "rate [rad/s]"),
        "fig28": _draw_zmp(followed, plans),
        "fig29": _draw_torques(followed),
    }


def _draw_stair(axes: Axes, step: tuple[float, float], count: int) -> None:
    """Treads from the rear ankle's on; an edge is a setback behind the ankle on its step."""
    tread, rise = step
    edges = np.arange(1, count) * tread - SETBACK
    x = np.concatenate([[-0.25], np.repeat(edges, 2), [(count - 1) * tread + 0.35]])
    z = np.repeat(np.arange(count) * rise, 2)
    axes.plot(x, z, color="0.4", linewidth=1.0)
    axes.fill_between(x, z, min(z) - 0.05, color="0.92", linewidth=0)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")


def _draw_segments(arrays: Mapping[str, Array], plan: Mapping[str, float], step: tuple[float, float]) -> Figure:
    figure, axes = make_axes(height_in=3.6)
    _draw_stair(axes, step, 3)
    place = arrays["ankle"] + np.array(step)
    ends = [0.0, plan["t1_s"], plan["t2_s"], plan["t_bc_s"], plan["t3_s"]]
    names = ("double support, heel rises", "double support, sole rises", "Bezier: catch the cycloid", "cycloid")
    for i, name in enumerate(names):
        part = (arrays["t"] >= ends[i] - 1e-9) & (arrays["t"] <= ends[i + 1] + 1e-9)
        axes.plot(*place[part].T, label=name)
    axes.set_ylabel("z [m]")
    axes.set_title(f"Fig. 3: swing ankle, case {DRAWN_CASE}")
    add_legend_below(figure)
    return figure


def _draw_sticks(motion: tuple[Signals, dict[str, Array]], step: tuple[float, float], name: str) -> Figure:
    figure, (signals, legs) = make_figure(height_in=3.4), motion
    t, first = signals.arrays["t"], name.startswith("first")
    poses = [int(np.abs(t - at).argmin()) for at in np.linspace(t[0], t[-1], STICKS)]
    for axes, side, leg in zip(figure.subplots(1, 2, sharey=True), (RIGHT, LEFT), ("swing", "stance"), strict=True):
        _draw_stair(axes, step, 2 if first else 3)
        lines = legs[side] + (np.zeros(2) if first else np.array(step))
        for k, pose in enumerate(poses):
            axes.plot(*lines[pose].T, color=LIGHT + (DARK - LIGHT) * k / (STICKS - 1), linewidth=0.8)
        for end, colour in ((0, "#D55E00"), (-1, "#009E73")):
            axes.plot(*lines[:, end].T, color=colour, linewidth=1.0)
        axes.set_title(f"{leg} leg, {name}")
    figure.axes[0].set_ylabel("z [m]")
    return figure


def _draw_ankle(arrays: Mapping[str, Array]) -> Figure:
    figure = make_figure(height_in=4.4)
    t, place = arrays["t"], arrays["ankle"]
    keep = np.concatenate([[True], np.diff(t) > 1e-9])
    t, place = t[keep], place[keep]
    velocity = np.gradient(place, t, axis=0)
    acceleration = np.gradient(velocity, t, axis=0)
    shown = {"velocity [m/s]": velocity, "acceleration [m/s\u00b2]": acceleration}
    for axes, (label, values) in zip(figure.subplots(2, 1, sharex=True), shown.items(), strict=True):
        for column, axis in enumerate("xz"):
            axes.plot(t, values[:, column], label=axis)
        axes.set_ylabel(label)
    figure.axes[0].set_title(f"Figs. 10, 11: swing ankle, case {DRAWN_CASE}")
    figure.axes[1].set_xlabel("time [s]")
    add_legend_below(figure)
    return figure


def _draw_stairs_compared(findings: StairsFindings) -> Figure:
    figure = make_figure(height_in=2.9)
    panels = figure.subplots(1, len(findings.cases), sharey=True, squeeze=False)[0]
    for axes, case in zip(panels, findings.cases, strict=True):
        step, (_, legs) = TABLE_4[case].step_m, move(findings, "jerk", case)
        _draw_stair(axes, step, 3)
        for i, name in enumerate(("ankle", "sole", "toe"), start=2):
            axes.plot(*(legs[RIGHT][:, i] + np.array(step)).T, label=name)
        axes.set_title(f"case {case}: {step[1] * 100:.1f} cm on {step[0] * 100:.1f} cm")
    figure.axes[0].set_ylabel("z [m]")
    add_legend_below(figure)
    return figure


def _draw_pose_times(network: Mapping[str, Any], case: int) -> Figure:
    figure, axes = make_axes()
    for rule, found in network.items():
        label = f"{rule}: {found['converged']} of {found['poses']} poses"
        axes.plot(np.array(found["time_s"]) * 1e3, label=label, linewidth=0.9)
    axes.set(xlabel="pose", ylabel="time [ms]", yscale="log", title=f"Fig. 13: training time of each pose, case {case}")
    add_legend_below(figure)
    return figure


def _draw_tracking(followed: Mapping[int, Mapping[str, Array]], name: str, unit: str) -> Figure:
    figure = make_figure(height_in=7.0)
    panels = figure.subplots(4, 2, sharex=True).ravel()
    for i, link in enumerate(TRACKED_LINKS):
        for case, arrays in followed.items():
            values = [arrays[which] @ PRINTED_ANGLES for which in (name, f"{name}_desired")]
            (line,) = panels[i].plot(arrays["t"], values[0][:, i], label=f"case {case}")
            panels[i].plot(arrays["t"], values[1][:, i], ":", color=line.get_color(), linewidth=1.0)
        panels[i].set_title(f"q{i + 1} ({link})")
        panels[i].set_ylabel(unit)
    panels[-1].set_axis_off()
    for axes in panels[-3:]:
        axes.set_xlabel("time [s]")
        axes.tick_params(labelbottom=True)  # also where the panel below is empty
    add_legend_below(figure)
    figure.suptitle("solid: rolled out, dotted: desired", fontsize=8)
    return figure


def _draw_zmp(followed: Mapping[int, Mapping[str, Array]], plans: Mapping[int, Mapping[str, float]]) -> Figure:
    figure, axes = make_axes()
    foot = load_toe_foot_biped().foot_m
    axes.axhspan(0.0, foot, color="0.9", label="stance foot")
    for case, arrays in followed.items():
        (line,) = axes.plot(arrays["t"], arrays["zmp"], label=f"case {case}")
        lift = plans[case]["t2_s"]
        axes.plot([0.0, lift], [foot - TABLE_4[case].step_m[0]] * 2, "--", color=line.get_color(), linewidth=0.8)
        axes.axvline(lift, color=line.get_color(), linewidth=0.6, linestyle=":")
    axes.set(xlabel="time [s]", ylabel="ZMP ahead of the stance ankle [m]", title="Fig. 28: ZMP of the rollout")
    add_legend_below(figure)
    return figure


def _draw_torques(followed: Mapping[int, Mapping[str, Array]]) -> Figure:
    figure = make_figure(height_in=2.9)
    panels = figure.subplots(1, len(followed), sharey=True, squeeze=False)[0]
    for axes, (case, arrays) in zip(panels, followed.items(), strict=True):
        for i, joint in enumerate(ANGLES["joint"]):
            line = "--" if joint.endswith("'") else "-"
            axes.plot(arrays["t"], arrays["tau"][:, i], line, label=joint, linewidth=1.0)
        axes.set(title=f"Fig. 29{'abc'[case - 1]}: case {case}", xlabel="time [s]")
    figure.axes[0].set_ylabel("joint torque [N m]")
    add_legend_below(figure)
    return figure
