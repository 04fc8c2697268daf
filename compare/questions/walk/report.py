"""What walking costs along an axis, as an answer: tables, and pictures of the cost and of one cycle over two steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.simulated_gaits import compute_agreement
from compare.analysis.units import millimetres, with_unit
from compare.drawing.figures import new_figure, style
from compare.drawing.labels import axis_label, name_in_words, units_of
from compare.questions.answer import Answer, all_digits, table_of
from compare.questions.sweep.report import mark
from compare.questions.walk.planners import Rival
from compare.questions.walk.planners_report import planners_parts
from compare.questions.walk.study import Gait, result_of
from compare.report.document import Figure, Part, Table, Value
from compare.study.task import ProblemSpec, describe_problem
from nlp_gait.formulation import GaitProblem, Result, sample_finely
from nlp_gait.gaits.several_steps import repeat_steps
from nlp_gait.simulation.measurements import Measurements, Walk

MODEL, ENGINE = "#000000", "#56B4E9"
LEFT, RIGHT, HIP = "#0072B2", "#D55E00", "#000000"
STEPS_SHOWN = 2
# Value on the axis, walk, and its measurements.
Played = tuple[float, Walk, Measurements]
LEG_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Indexes of the table of numbers.
INDEXES = (
    "power_W energy_J_per_m cost_of_transport speed_m_s step_length_m ssp_power_W dsp_power_W ssp_dbm_x_min_m "
    "ssp_dbm_y_min_m ssp_dbm_x_mean_m ssp_dbm_y_mean_m dsp_dbm_x_mean_m dsp_dbm_y_mean_m "
    "touch_down_torque_jump_Nm lift_off_torque_jump_Nm"
).split()
# What it says of the walk in the engine, and of the measurements there.
WALKED = (
    "steps",
    "steps_done",
    "planned_m",
    "walked_m",
    "drift_m",
    "heading_deg",
    "engine_J_per_planned_m",
    "engine_J_per_m",
)
MEASURED = ("largest_tilt_deg", "tracking_max_rad", "mechanical_W", "heat_W")


def walk_answer(spec: ProblemSpec, gaits: Sequence[Gait], rivals: Sequence[Rival] = ()) -> Answer:
    """What walking costs along the axis, from at least one gait, and what other planners need over the same footsteps."""
    (name,), problem = gaits[0].found.at, spec.load()
    feasible = [gait for gait in gaits if gait.found.feasible]
    placed = {f"{problem.name}-{name}-{gait.at:g}": result_of(spec, gait.found) for gait in feasible}
    cheapest_cycles = table_of(
        "Cheapest cycles, with the times of single and double support",
        feasible,
        {
            name: lambda gait: f"{gait.at:g}",
            "power": lambda gait: f"{gait.indexes['power_W']:.4f} W",
            "cost of transport": lambda gait: f"{gait.indexes['cost_of_transport']:.4f}",
            "step": lambda gait: f"{gait.indexes['step_length_m']:.4f} m",
            "single": lambda gait: f"{gait.found.x[problem.display.durations[0]]:.3f} s",
            "double": lambda gait: f"{gait.found.x[problem.display.durations[1]]:.3f} s",
        },
    )
    costs = Figure(
        name=f"{problem.name}-cost",
        caption="Cost of transport, step and times; crosses where no feasible cycle was found.",
        drawing=plot_by_cost(gaits, problem),
    )
    parts: list[Part] = [
        cheapest_cycles,
        *(f"{name} = {gait.at:g}: {gait.found.status}" for gait in gaits if not gait.found.feasible),
        *_walks(name, gaits),
        *planners_parts(problem, gaits, rivals),
        costs,
    ]
    if feasible:
        cheapest = min(feasible, key=lambda gait: gait.indexes["cost_of_transport"])
        drawing = cycle_figure(result_of(spec, cheapest.found))
        caption = "Two steps of the cheapest cycle: hip and feet, and the left leg's angles."
        parts.append(Figure(name=problem.name, caption=caption, drawing=drawing))
    stem = f"{problem.name}-walk"
    parts.append(_numbers(stem, gaits))
    return Answer(
        stem=stem,
        title=f"{problem.name}: cheapest cycles over {name}",
        parts=parts,
        data={"gaits": [gait.to_json() for gait in gaits], "planners": [rival.to_json() for rival in rivals]},
        results={file: {**describe_problem(r.problem), "x": r.problem.by_name(r.x)} for file, r in placed.items()},
    )


def _walks(name: str, gaits: Sequence[Gait]) -> list[Part]:
    """How the gaits that were played fared, and how far that confirms the model."""
    walks = [(gait.at, gait.walk, gait.walk.measurements) for gait in gaits if gait.walk is not None]
    if not walks:
        return []
    energies: dict[str, Callable[[Played], str]] = {
        name: lambda row: f"{row[0]:g}",
        "model": lambda row: with_unit(row[1].model_J_per_m, "J/m", ".2f"),
        "engine": lambda row: with_unit(row[1].engine_J_per_planned_m, "J/m", ".2f"),
        "error": lambda row: _error(row[1]),
        "per walked m": lambda row: with_unit(row[1].engine_J_per_m, "J/m", ".2f"),
        "way": lambda row: _way(row[1]),
        "fate": lambda row: _fate(row[1]),
    }
    courses: dict[str, Callable[[Played], str]] = {
        name: lambda row: f"{row[0]:g}",
        "walked": lambda row: millimetres(row[1].walked_m, ".0f"),
        "of": lambda row: millimetres(row[1].planned_m, ".0f"),
        "drift": lambda row: millimetres(row[1].drift_m),
        "heading": lambda row: with_unit(row[1].heading_deg, "deg", ".2f"),
        "tilt": lambda row: with_unit(row[2].largest_tilt_deg, "deg", ".1f"),
        "tracking": lambda row: with_unit(row[2].tracking_max_rad, "rad", ".4f"),
    }
    steps = walks[0][1].steps
    agreed = compute_agreement(
        [walk.model_J_per_m for _, walk, _ in walks], [walk.engine_J_per_planned_m for _, walk, _ in walks]
    )
    return [
        table_of(f"Energy of {steps} steps in the physics engine, for each planned metre", walks, energies),
        agreed.describe(),
        table_of(f"Course of the {steps} steps", walks, courses),
    ]


def _error(walked: Walk) -> str:
    """Of the model."""
    if walked.engine_J_per_planned_m is None:
        return "-"
    return f"{100.0 * (walked.engine_J_per_planned_m / walked.model_J_per_m - 1.0):+z.2f} %"


def _way(walked: Walk) -> str:
    """Walked part of the planned way."""
    return "-" if walked.walked_m is None else f"{100.0 * walked.walked_m / walked.planned_m:.1f} %"


def _fate(walked: Walk) -> str:
    fell_at_s = walked.measurements.fell_at_s
    fate = "walks" if fell_at_s is None else f"falls at {fell_at_s:.2f} s"
    return fate if walked.steps_done == walked.steps else f"{fate}, {walked.steps_done} steps"


def _numbers(stem: str, gaits: Sequence[Gait]) -> Table:
    (name,), x = gaits[0].found.at, gaits[0].found.x
    own = f"at {name}" if name in x or name in INDEXES else name
    header = [own, "feasible", *INDEXES, *x, *(f"engine_{key}" for key in (*WALKED, *MEASURED)), "status"]
    rows: list[list[Value]] = []
    for gait in gaits:
        engine: list[Value] = [None] * (len(WALKED) + len(MEASURED))
        if gait.walk is not None:
            found = gait.walk.measurements
            engine = [getattr(gait.walk, key) for key in WALKED]
            engine += [found.largest_tilt_deg, found.tracking_max_rad]
            engine += [found.measured.mechanical_W, found.measured.heat_W]
        indexes = [gait.indexes[key] for key in INDEXES]
        rows.append([gait.at, gait.found.feasible, *indexes, *gait.found.x.values(), *engine, gait.found.status])
    return all_digits(stem, header, rows)


def plot_by_cost(gaits: Sequence[Gait], problem: GaitProblem) -> Drawing:
    """Cost of transport, step length and times along the axis; infeasible points as crosses at the bottom."""
    (name,) = gaits[0].found.at
    good = [gait for gait in gaits if gait.found.feasible]
    at = [gait.at for gait in good]
    with style():
        figure = new_figure(6.3, 5.0)
        cost, lengths, times = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
        cost.plot(at, [gait.indexes["cost_of_transport"] for gait in good], "o-", color=MODEL, label="model")
        _engine_costs(cost, good)
        mark(cost, [gait.at for gait in gaits if not gait.found.feasible], "infeasible")
        cost.set_ylabel("cost of transport\nP / (m g v)")
        cost.set_ylim(bottom=0.0)
        cost.legend()
        lengths.plot(at, [1000.0 * gait.indexes["step_length_m"] for gait in good], "o-", color=MODEL)
        lengths.set_ylabel("step\n[mm]")
        lengths.set_ylim(bottom=0.0)
        for time, colour in zip(problem.display.durations, (LEFT, RIGHT), strict=True):
            phase = name_in_words(time, "s").removesuffix(" time")  # for example "single support"
            times.plot(at, [gait.found.x[time] for gait in good], "o-", color=colour, label=phase)
        times.set_ylabel("time [s]")
        times.set_ylim(bottom=0.0)
        times.legend(ncols=2)
        times.set_xlabel(axis_label(name, units_of(problem)[name]))
    return figure


def _engine_costs(axes: Axes, gaits: Sequence[Gait]) -> None:
    """What the played walks drew from the servos, over the distance that they really came."""
    points = [
        (gait.at, gait.walk.engine_J_per_m / gait.indexes["energy_J_per_m"] * gait.indexes["cost_of_transport"])
        for gait in gaits
        if gait.walk is not None and gait.walk.engine_J_per_m is not None
    ]
    if points:
        axes.plot(*zip(*points, strict=True), "s--", color=ENGINE, label="physics engine")
    fallen = [gait.at for gait in gaits if gait.walk is not None and gait.walk.measurements.fallen]
    mark(axes, fallen, "falls", "v", RIGHT, 0.1)


def cycle_figure(result: Result) -> Drawing:
    """Two steps of a cycle: paths of hip and feet from the side and from above, and the angles of the left leg."""
    problem = result.problem
    assert problem.display.simulation_model is not None  # a cycle can be played; for the type checker
    robot = problem.display.simulation_model.robot
    signals = repeat_steps(sample_finely(result), robot, STEPS_SHOWN)
    leg = [joint.name for joint in reversed(robot.path_to_root(robot.feet["left"].link))]
    arrays, t, hip = signals.arrays, signals.arrays["t"], 1000.0 * signals.arrays["hip"]
    durations = [float(result.x[problem.variable_index(name)]) for name in problem.display.durations]
    switches = np.cumsum([0.0] + durations * STEPS_SHOWN)
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
        turning = [name for name in leg if np.ptp(arrays["q"][:, signals.joints.index(name)]) > 0.0]
        for name, colour in zip(turning, LEG_COLOURS, strict=False):
            angles.plot(t, arrays["q"][:, signals.joints.index(name)], color=colour, label=name)
        angles.set(ylabel="angle [rad]", xlabel="time [s]; solid: lift-off, dashed: touch-down")
        for axes in (place, angles):
            axes.set_xlim(0.0, t[-1])
            for k, switch in enumerate(switches):
                axes.axvline(switch, color="#a0a0a0", lw=0.8, ls="-" if k % 2 == 0 else "--")
        for axes in (side, above, place, angles):
            columns = 5 if len(axes.get_legend_handles_labels()[1]) <= 5 else 3
            axes.legend(
                ncols=columns,
                loc="lower right",
                bbox_to_anchor=(1.0, 1.0),
                borderaxespad=0.1,
                columnspacing=1.0,
            )
    return figure
