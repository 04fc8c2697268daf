"""Pictures of walking: what it costs along an axis, and one cycle over two steps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import new_figure, save, style
from compare.drawing.labels import axis_label
from compare.questions.walk.study import Gait
from nlp_gait.problem import GaitProblem, Result, finely_sampled
from nlp_gait.problems.nao.body import nao
from nlp_gait.problems.nao.cycle_motion import TIMES
from nlp_gait.simulation.steps import walk

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MODEL, ENGINE = "#000000", "#56B4E9"
LEFT, RIGHT, HIP = "#0072B2", "#D55E00", "#000000"
STEPS_SHOWN = 2
LEG = ("HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
LEG_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")


def cost_figure(gaits: Sequence[Gait], problem: GaitProblem) -> Figure:
    """Cost of transport, step length and times along the axis; infeasible points as crosses at the bottom."""
    (name,) = gaits[0].found.at
    units = {v.name: v.unit for v in problem.variables} | {q.name: q.unit for q in problem.parameters}
    good = [gait for gait in gaits if gait.found.feasible]
    at = [gait.at for gait in good]
    with style():
        figure = new_figure(6.3, 5.0)
        cost, lengths, times = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
        cost.plot(at, [gait.indexes["cost_of_transport"] for gait in good], "o-", color=MODEL, label="model")
        _engine_costs(cost, good)
        bad = [gait.at for gait in gaits if not gait.found.feasible]
        if bad:
            cost.plot(
                bad, np.full(len(bad), 0.03), "x", color="0.4", label="infeasible", transform=cost.get_xaxis_transform()
            )
        cost.set_ylabel("cost of transport\nP / (m g v)")
        cost.set_ylim(bottom=0.0)
        cost.legend()
        lengths.plot(at, [1000.0 * gait.indexes["step_length_m"] for gait in good], "o-", color=MODEL)
        lengths.set_ylabel("step\n[mm]")
        lengths.set_ylim(bottom=0.0)
        for phase, label, colour in (("ssp", "single support", LEFT), ("dsp", "double support", RIGHT)):
            times.plot(at, [gait.found.x[TIMES[phase]] for gait in good], "o-", color=colour, label=label)
        times.set_ylabel("time [s]")
        times.set_ylim(bottom=0.0)
        times.legend(ncols=2)
        times.set_xlabel(axis_label(name, units[name]))
    return figure


def _engine_costs(axes: Axes, gaits: Sequence[Gait]) -> None:
    """What the played walks drew from the servos, over the distance that they really came."""
    points = [
        (gait.at, gait.walk.energy_J_per_m / gait.indexes["energy_J_per_m"] * gait.indexes["cost_of_transport"])
        for gait in gaits
        if gait.walk is not None and gait.walk.energy_J_per_m is not None
    ]
    if points:
        axes.plot(*zip(*points, strict=True), "s--", color=ENGINE, label="physics engine")
    fallen = [gait.at for gait in gaits if gait.walk is not None and gait.walk.measurements.fallen]
    if fallen:
        axes.plot(
            fallen, np.full(len(fallen), 0.1), "v", color=RIGHT, label="falls", transform=axes.get_xaxis_transform()
        )


def cycle_figure(result: Result) -> Figure:
    """Two steps of a cycle: paths of hip and feet from the side and from above, and the angles of the left leg."""
    robot = nao(str(result.problem.options["robot"]), rotational_inertia=True)
    signals = walk(finely_sampled(result), robot, STEPS_SHOWN)
    arrays, t, hip = signals.arrays, signals.arrays["t"], 1000.0 * signals.arrays["hip"]
    single, double = (float(result.x[result.problem.variable_index(TIMES[phase])]) for phase in ("ssp", "dsp"))
    switches = np.cumsum([0.0] + [single, double] * STEPS_SHOWN)
    with style():
        figure = new_figure(6.3, 7.2)
        side, above, place, angles = figure.subplots(4, 1, height_ratios=(1.0, 1.2, 1.2, 1.6))
        side.sharex(above)
        for foot, colour in (("left", LEFT), ("right", RIGHT)):
            path = 1000.0 * arrays[f"{foot}_foot"]
            side.plot(path[:, 0], path[:, 2], color=colour, label=f"{foot} foot")
            above.plot(path[:, 0], path[:, 1], color=colour)
        lowest, at = hip[:, 2].min(), np.searchsorted(t, np.minimum(switches, t[-1]))
        side.plot(hip[:, 0], hip[:, 2] - lowest, color=HIP, label=f"hip less {lowest:.1f} mm")
        above.plot(hip[:, 0], hip[:, 1], color=HIP, label="hip")
        above.plot(hip[at, 0], hip[at, 1], "o", color=HIP, label="hip at a switch")
        zmp = 1000.0 * arrays["zmp"]
        above.plot(zmp[:, 0], zmp[:, 1], color=ENGINE, lw=0.8, label="ZMP")
        side.set_ylabel("z [mm]")
        above.set(ylabel="y [mm]", xlabel="x [mm]")
        for k, axis in enumerate("xyz"):
            place.plot(t, hip[:, k] - hip[0, k], color=LEG_COLOURS[k], label=f"hip {axis} less its start")
        place.set_ylabel("[mm]")
        for name, colour in zip(LEG, LEG_COLOURS, strict=True):
            column = signals.joints.index(f"L{name}")
            angles.plot(t, arrays["q"][:, column], color=colour, label=f"L{name}")
        angles.set(ylabel="angle [rad]", xlabel="time [s]; solid: lift-off, dashed: touch-down")
        for axes in (place, angles):
            axes.set_xlim(0.0, t[-1])
            for k, switch in enumerate(switches):
                axes.axvline(switch, color="#a0a0a0", lw=0.8, ls="-" if k % 2 == 0 else "--")
        for axes in (side, above, place, angles):
            axes.legend(ncols=5, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, columnspacing=1.0)
    return figure


def write_figures(folder: Path, gaits: Sequence[Gait], problem: GaitProblem, shown: Result | None) -> list[Path]:
    """Write both pictures, that of a cycle only if there is one; returns the paths."""
    written = list(save(cost_figure(gaits, problem), folder / "nao-cycle-cost"))
    if shown is not None:
        written += save(cycle_figure(shown), folder / "nao-cycle")
    return written
