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
        front, aside, above = canvas.subplots(1, 3)
        for joint in robot.joints.values():
            end = np.sum([ancestor.origin_m for ancestor in robot.path_to_root(joint.child)], axis=0)
            start = end - np.array(joint.origin_m)
            side = next((s for s in SIDES if joint.name in biped.legs[s].joints), None)
            look = {"color": LEGS[side] if side else OTHERS, "lw": 2.0 if side else 1.0, "marker": "o", "ms": 2.5}
            front.plot(*zip(start[1:], end[1:], strict=True), **look)
            aside.plot(*zip(start[[0, 2]], end[[0, 2]], strict=True), **look)
        for side in SIDES:
            leg, foot = biped.legs[side], robot.feet[side]
            x, y, z = leg.foot_m
            z -= foot.ankle_height_m
            front.plot([y - foot.right_m, y + foot.left_m], [z, z], color=LEGS[side], lw=3.0)
            aside.plot([x - foot.back_m, x + foot.front_m], [z, z], color=LEGS[side], lw=3.0)
            corners = [(-foot.back_m, -foot.right_m), (foot.front_m, -foot.right_m), (foot.front_m, foot.left_m)]
            corners += [(-foot.back_m, foot.left_m), (-foot.back_m, -foot.right_m)]
            above.plot(*(np.array(corners) + [x, y]).T, color=LEGS[side], label=f"{side} sole")
            above.plot(x, y, "o", color=LEGS[side], ms=4)
            above.plot(*leg.hip_m[:2], "x", color=LEGS[side], ms=6)
        front.invert_xaxis()  # seen from behind: left is left
        for axes, across, up in ((front, "y", "z"), (aside, "x", "z"), (above, "x", "y")):
            axes.set_xlabel(f"{across} [m]")
            axes.set_ylabel(f"{up} [m]")
            axes.set_aspect("equal", adjustable="datalim")
        above.legend(loc="center")
        above.set_title("soles, joints (o) and hips (x)")
        front.set_title("from behind")
        aside.set_title("from the right")
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
        for axis, name, k in ((axes[0], "x", 0), (axes[1], "y", 1)):
            axis.plot(t, trace.pressure[shown, k], color=ENGINE, lw=0.3, alpha=0.6, label="centre of pressure")
            axis.plot(t, smooth[:, k], color=LEGS["left"], label=f"mean over {1000 * drive.period_s:g} ms")
            axis.plot(t, zmp[:, k], color=MODEL, label="planned ZMP")
            axis.set_ylabel(f"{name} [m]")
        axes[0].legend(loc="best", ncols=3)
        axes[2].plot(t, np.abs(trace.torque * trace.qd).sum(axis=1)[shown], color=ENGINE, lw=0.5, label="engine")
        power = np.abs(planned["tau"] * planned["qd"]).sum(axis=1)
        axes[2].plot(planned["t"], power, color=MODEL, label="model")
        axes[2].set_ylabel("mechanical\npower [W]")
        axes[2].legend(loc="best", ncols=2)
        for i, side in enumerate(SIDES):
            axes[3].plot(t, trace.loads[shown, i], color=LEGS[side], lw=0.5, label=f"{side} foot")
        axes[3].set_ylabel("load [N]")
        axes[3].set_xlabel("time [s]")
        axes[3].legend(loc="best", ncols=2)
        for axis in axes:
            axis.axvline(plan.duration_s, color="#a0a0a0", lw=0.8)
    return save_figure(figure, path)
