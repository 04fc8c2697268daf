"""Figures of a robot as read and of its simulation."""

from pathlib import Path

import numpy as np

from compare.drawing.figures import LEGS, make_figure, save_figure, use_style
from nlp_gait.robots.biped import Biped
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.simulate import Simulation

OTHERS = "#999999"
EVERY = 4  # steps of the engine; more points than a page can show make the files large
ENGINE, MODEL = "#56B4E9", "#000000"


def plot_robot(biped: Biped, path: Path) -> Path:
    """Write a figure as PNG or PDF and return its path; raises OutputError."""
    robot = biped.full
    with use_style():
        canvas = make_figure(9.0, 4.4)
        views = front, aside, above = canvas.subplots(1, 3)
        for joint in robot.joints.values():
            end = np.sum([ancestor.origin_m for ancestor in robot.path_to_root(joint.child)], axis=0)
            ends = np.array([end - np.array(joint.origin_m), end]).T
            side = next((s for s in SIDES if joint.name in biped.legs[s].joints), None)
            look = {"color": LEGS[side] if side else OTHERS, "lw": 2.0 if side else 1.0, "marker": "o", "ms": 2.5}
            front.plot(*ends[1:], **look)
            aside.plot(*ends[[0, 2]], **look)
        for side in SIDES:
            leg, foot, look = biped.legs[side], robot.feet[side], {"color": LEGS[side]}
            x, y, z = leg.foot_m - np.array([0.0, 0.0, foot.ankle_height_m])
            across, along = [y - foot.right_m, y + foot.left_m], [x - foot.back_m, x + foot.front_m]
            front.plot(across, [z, z], lw=3.0, **look)
            aside.plot(along, [z, z], lw=3.0, **look)
            above.plot(
                [along[k] for k in (0, 1, 1, 0, 0)], [across[k] for k in (0, 0, 1, 1, 0)], label=f"{side} sole", **look
            )
            above.plot(x, y, "o", ms=4, **look)
            above.plot(*leg.hip_m[:2], "x", ms=6, **look)
        front.invert_xaxis()  # seen from behind: left is left
        words = ("from behind", "y", "z"), ("from the right", "x", "z"), ("soles, joints (o) and hips (x)", "x", "y")
        for axes, (title, x_name, y_name) in zip(views, words, strict=True):
            axes.set(title=title, xlabel=f"{x_name} [m]", ylabel=f"{y_name} [m]")
            axes.set_aspect("equal", adjustable="datalim")
        above.legend(loc="center")
        canvas.suptitle(robot.name)
        return save_figure(canvas, path)


def plot_simulation(plan: Plan, trace: Simulation, drive: Drive, path: Path) -> Path:
    """Write a figure as PNG or PDF and return its path; raises OutputError."""
    planned, shown = plan.signals.arrays, slice(None, None, EVERY)
    t = trace.t[shown]
    with use_style():
        figure = make_figure(6.3, 6.0)
        axes = figure.subplots(4, 1, sharex=True)
        smooth, zmp = average_pressure(trace, drive.period_s)[shown], plan.at("zmp", t)
        for k in (0, 1):
            axes[k].plot(t, trace.pressure[shown, k], color=ENGINE, lw=0.3, alpha=0.6, label="centre of pressure")
            axes[k].plot(t, smooth[:, k], color=LEGS["left"], label=f"mean over {1000 * drive.period_s:g} ms")
            axes[k].plot(t, zmp[:, k], color=MODEL, label="planned ZMP")
        axes[2].plot(t, np.abs(trace.torque * trace.qd).sum(axis=1)[shown], color=ENGINE, lw=0.5, label="engine")
        axes[2].plot(planned["t"], np.abs(planned["tau"] * planned["qd"]).sum(axis=1), color=MODEL, label="model")
        for i, side in enumerate(SIDES):
            axes[3].plot(t, trace.loads[shown, i], color=LEGS[side], lw=0.5, label=f"{side} foot")
        labels = ("x [m]", "y [m]", "mechanical\npower [W]", "load [N]")
        for k, (axis, label) in enumerate(zip(axes, labels, strict=True)):
            axis.set_ylabel(label)
            axis.axvline(plan.duration_s, color="#a0a0a0", lw=0.8)
            if k != 1:
                axis.legend(loc="best", ncols=3)
        axes[3].set_xlabel("time [s]")
    return save_figure(figure, path)
