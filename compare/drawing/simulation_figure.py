"""Figure of a simulation: centre of pressure, power and loads compared with the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compare.drawing.figures import new_figure, save, style
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import average_pressure
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.simulate import Simulation

EVERY = 4  # steps of the engine; more points than a page can show make the files large
ENGINE, MODEL = "#56B4E9", "#000000"
SIDE_COLOURS = dict(zip(SIDES, ("#0072B2", "#D55E00"), strict=True))


def plot_simulation(plan: Plan, trace: Simulation, drive: Drive, stem: Path) -> tuple[Path, Path]:
    """Write ``<stem>.png`` and ``.svg``; raises OutputError."""
    planned, shown = plan.signals.arrays, slice(None, None, EVERY)
    t = trace.t[shown]
    with style():
        figure = new_figure(6.3, 6.0)
        axes = figure.subplots(4, 1, sharex=True)
        smooth, zmp = average_pressure(trace, drive.period_s)[shown], plan.at("zmp", t)
        for axis, name, k in ((axes[0], "x", 0), (axes[1], "y", 1)):
            axis.plot(t, trace.pressure[shown, k], color=ENGINE, lw=0.3, alpha=0.6, label="centre of pressure")
            axis.plot(t, smooth[:, k], color=SIDE_COLOURS["left"], label=f"mean over {1000 * drive.period_s:g} ms")
            axis.plot(t, zmp[:, k], color=MODEL, label="planned ZMP")
            axis.set_ylabel(f"{name} [m]")
        axes[0].legend(loc="best", ncols=3)
        axes[2].plot(t, np.abs(trace.torque * trace.qd).sum(axis=1)[shown], color=ENGINE, lw=0.5, label="engine")
        power = np.abs(planned["tau"] * planned["qd"]).sum(axis=1)
        axes[2].plot(planned["t"], power, color=MODEL, label="model")
        axes[2].set_ylabel("mechanical\npower [W]")
        axes[2].legend(loc="best", ncols=2)
        for i, side in enumerate(SIDES):
            axes[3].plot(t, trace.loads[shown, i], color=SIDE_COLOURS[side], lw=0.5, label=f"{side} foot")
        axes[3].set_ylabel("load [N]")
        axes[3].set_xlabel("time [s]")
        axes[3].legend(loc="best", ncols=2)
        for axis in axes:
            axis.axvline(plan.duration_s, color="#a0a0a0", lw=0.8)
    return save(figure, stem)
