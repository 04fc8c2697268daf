"""What walking costs: cheapest cycles over the speed or another axis, their simulation, and other planners."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.simulated_gaits import compute_agreement
from compare.analysis.units import format_millimetres, list_units, make_axis_label, name_in_words, with_unit
from compare.drawing.figures import make_figure, use_style
from compare.questions.question import Answer, Question, Work, make_csv_table, make_table
from compare.questions.sweep import Axis, Sweep, mark_values
from compare.questions.walk.cheapest_cycle import Gait, describe_end, make_gait, simulate_walk
from compare.questions.walk.planners import PlannedGait, check_planners, plan_gaits, report_planners
from compare.report.document import Figure, Part, Table, Value
from compare.study.task import describe_problem
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result, sample_finely
from nlp_gait.gaits.biped.cycle import SPEED, SPEED_M_S
from nlp_gait.gaits.capabilities import CART_TABLE_BODIES
from nlp_gait.gaits.several_steps import repeat_steps
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.measurements import Measurements, Walk

SPEEDS_M_S = (0.01, 0.1)  # of NAO
MODEL, ENGINE = "#000000", "#56B4E9"
LEFT, RIGHT, HIP = "#0072B2", "#D55E00", "#000000"
STEPS_SHOWN = 2
# Value on the axis, walk, and its measurements.
Simulated = tuple[float, Walk, Measurements]
LEG_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Indexes of the CSV table, and its columns of the walk in the engine and of the measurements there.
INDEXES = (
    "power_W energy_J_per_m cost_of_transport speed_m_s step_length_m ssp_power_W dsp_power_W ssp_dbm_x_min_m "
    "ssp_dbm_y_min_m ssp_dbm_x_mean_m ssp_dbm_y_mean_m dsp_dbm_x_mean_m dsp_dbm_y_mean_m "
    "touch_down_torque_jump_Nm lift_off_torque_jump_Nm"
).split()
WALKED = "steps steps_done planned_m walked_m drift_m heading_deg engine_J_per_planned_m engine_J_per_m".split()
MEASURED = ("largest_tilt_deg", "tracking_max_rad", "mechanical_W", "heat_W")


class FoundGaits(NamedTuple):
    """Cheapest gaits, and those of other planners on the same footsteps."""

    gaits: tuple[Gait, ...]
    others: tuple[PlannedGait, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class CheapestWalk(Question[FoundGaits]):
    """What does walking cost along an axis? The problem is a walking cycle with the power as its objective."""

    name: ClassVar[str] = "walk"

    axis: Axis  #: parameter or variable; by default ten speeds
    starts: int = 5  #: random starts of IPOPT at both ends of the axis, and where no neighbour helps
    seed: int = 0  #: of these starts
    steps: int = 0  #: number of steps of each gait to simulate; 0 for none (extra ``sim``)
    drive: Drive = Drive()  #: of the simulation
    planners: Sequence[str] = ()  #: other planners, on the same footsteps

    def __post_init__(self) -> None:
        """Validate problem and planners, and require MuJoCo if it is needed.

        Raises:
            InputError: the problem is not a walking cycle, or a planner is unknown or does not support it.
            MissingExtraError: MuJoCo is not installed.
        """
        check_cycle(self.problem.name)
        check_planners(self.planners, self.problem)
        if self.steps:
            load_mujoco()

    @property
    def inputs(self) -> dict[str, Any]:
        # Simulations and planners do not change the gaits.
        return {"over": {self.axis.name: list(self.axis.values)}, "starts": self.starts, "seed": self.seed}

    @property
    def total(self) -> int:
        # Two solves, a simulation and the planners at each point.
        return len(self.axis.values) * (2 + bool(self.steps) + len(set(self.planners)))

    def find(self, work: Work) -> Iterator[FoundGaits]:
        problem, gaits = self.problem, list[Gait]()
        for points in Sweep(problem=problem, axes=[self.axis], starts=self.starts, seed=self.seed).find(work):
            gaits = [make_gait(problem, point) for point in points]
            yield FoundGaits(tuple(gaits))
        for i, gait in enumerate(gaits if self.steps else ()):
            if gait.point.feasible:
                gaits[i] = replace(gait, walk=simulate_walk(gait.result, self.steps, self.drive, work))
                yield FoundGaits(tuple(gaits))
            work.progress(f"{gait.at:g}")
        others: tuple[PlannedGait, ...] = ()
        options = {"starts": self.starts, "seed": self.seed, "steps": self.steps}
        planners = tuple(dict.fromkeys(self.planners))
        for other in plan_gaits(problem, gaits, planners, **options, drive=self.drive, work=work):
            others = (*others, other)
            yield FoundGaits(tuple(gaits), others)

    def report(self, findings: FoundGaits) -> Answer:
        gaits, others = findings
        problem, name = self.problem, self.axis.name
        feasible = [gait for gait in gaits if gait.point.feasible]
        single, double = problem.display.durations
        columns: dict[str, Callable[[Gait], str]] = {
            name: lambda gait: f"{gait.at:g}",
            "power": lambda gait: f"{gait.indexes['power_W']:.4f} W",
            "cost of transport": lambda gait: f"{gait.indexes['cost_of_transport']:.4f}",
            "step": lambda gait: f"{gait.indexes['step_length_m']:.4f} m",
            "single": lambda gait: f"{gait.point.x[single]:.3f} s",
            "double": lambda gait: f"{gait.point.x[double]:.3f} s",
        }
        costs = Figure(
            name=f"{problem.name}-cost",
            caption="Cost of transport, step and durations; crosses where no feasible cycle was found.",
            drawing=plot_costs(name, gaits, problem),
        )
        parts: list[Part] = [
            make_table("Cheapest cycles, with the durations of single and double support", feasible, columns),
            *(f"{name} = {gait.at:g}: {gait.point.status}" for gait in gaits if not gait.point.feasible),
            *_report_simulations(name, gaits),
            *report_planners(problem, gaits, others),
            costs,
        ]
        if feasible:
            cheapest = min(feasible, key=lambda gait: gait.indexes["cost_of_transport"])
            caption = "Two steps of the cheapest cycle: hip and feet, and the left leg's angles."
            parts.append(Figure(name=problem.name, caption=caption, drawing=plot_cycle(cheapest.result)))
        stem = f"{problem.name}-walk"
        return Answer(
            stem=stem,
            title=f"{problem.name}: cheapest cycles over {name}",
            parts=[*parts, _make_csv(stem, name, gaits)],
            data={"gaits": [gait.to_json() for gait in gaits], "planners": [other.to_json() for other in others]},
            results={
                f"{problem.name}-{name}-{gait.at:g}": {**describe_problem(gait.result.problem), "x": dict(gait.point.x)}
                for gait in feasible
            },
        )

    def failures(self, findings: FoundGaits) -> list[str]:
        first = findings.gaits[0].point
        return [] if any(gait.point.feasible for gait in findings.gaits) else [first.status]


def check_cycle(name: str) -> None:
    """Raise InputError if a problem is not a walking cycle."""
    if name not in CART_TABLE_BODIES:
        raise InputError(f"walk takes a walking cycle, {' or '.join(CART_TABLE_BODIES)}; got {name!r}")


def choose_speeds(problem: GaitProblem) -> str:
    """Return ten speeds as the text of an axis: NAO's, of other robots at the same Froude numbers."""
    (speed,) = (parameter.default for parameter in problem.parameters if parameter.name == SPEED)
    low, high = (speed * limit / SPEED_M_S for limit in SPEEDS_M_S)
    return f"{SPEED}={low:.3g}:{high:.3g}:10"


def _report_simulations(name: str, gaits: Sequence[Gait]) -> list[Part]:
    """Tables of the simulated gaits, and how well they confirm the model."""
    walks = [(gait.at, gait.walk, gait.walk.measurements) for gait in gaits if gait.walk is not None]
    if not walks:
        return []
    energies: dict[str, Callable[[Simulated], str]] = {
        name: lambda row: f"{row[0]:g}",
        "model": lambda row: with_unit(row[1].model_J_per_m, "J/m", ".2f"),
        "engine": lambda row: with_unit(row[1].engine_J_per_planned_m, "J/m", ".2f"),
        "error": lambda row: _format_error(row[1]),
        "per walked m": lambda row: with_unit(row[1].engine_J_per_m, "J/m", ".2f"),
        "distance": lambda row: _format_distance(row[1]),
        "end": lambda row: _describe_end(row[1]),
    }
    courses: dict[str, Callable[[Simulated], str]] = {
        name: lambda row: f"{row[0]:g}",
        "walked": lambda row: format_millimetres(row[1].walked_m, ".0f"),
        "of": lambda row: format_millimetres(row[1].planned_m, ".0f"),
        "drift": lambda row: format_millimetres(row[1].drift_m),
        "heading": lambda row: with_unit(row[1].heading_deg, "deg", ".2f"),
        "tilt": lambda row: with_unit(row[2].largest_tilt_deg, "deg", ".1f"),
        "tracking": lambda row: with_unit(row[2].tracking_max_rad, "rad", ".4f"),
    }
    steps = walks[0][1].steps
    agreed = compute_agreement([w.model_J_per_m for _, w, _ in walks], [w.engine_J_per_planned_m for _, w, _ in walks])
    return [
        make_table(f"Energy of {steps} steps in the engine, for each planned metre", walks, energies),
        agreed.describe(),
        make_table(f"Course of the {steps} steps", walks, courses),
    ]


def _format_error(walk: Walk) -> str:
    if walk.engine_J_per_planned_m is None:
        return "-"
    return f"{100.0 * (walk.engine_J_per_planned_m / walk.model_J_per_m - 1.0):+z.2f} %"


def _format_distance(walk: Walk) -> str:
    return "-" if walk.walked_m is None else f"{100.0 * walk.walked_m / walk.planned_m:.1f} %"


def _describe_end(walk: Walk) -> str:
    end = describe_end(walk)
    return end if walk.steps_done == walk.steps else f"{end}, {walk.steps_done} steps"


def _make_csv(stem: str, name: str, gaits: Sequence[Gait]) -> Table:
    x = gaits[0].point.x
    axis = f"at {name}" if name in x or name in INDEXES else name
    header = [axis, "feasible", *INDEXES, *x, *(f"engine_{key}" for key in (*WALKED, *MEASURED)), "status"]
    rows: list[list[Value]] = []
    for gait in gaits:
        engine: list[Value] = [None] * (len(WALKED) + len(MEASURED))
        if gait.walk is not None:
            found = gait.walk.measurements
            engine = [getattr(gait.walk, key) for key in WALKED]
            engine += [found.largest_tilt_deg, found.tracking_max_rad]
            engine += [found.measured.mechanical_W, found.measured.heat_W]
        indexes = [gait.indexes[key] for key in INDEXES]
        rows.append([gait.at, gait.point.feasible, *indexes, *gait.point.x.values(), *engine, gait.point.status])
    return make_csv_table(stem, header, rows)


def plot_costs(name: str, gaits: Sequence[Gait], problem: GaitProblem) -> Drawing:
    """Plot cost of transport, step length and durations along the axis; infeasible points as crosses."""
    good = [gait for gait in gaits if gait.point.feasible]
    at = [gait.at for gait in good]
    with use_style():
        figure = make_figure(6.3, 5.0)
        cost, lengths, times = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
        cost.plot(at, [gait.indexes["cost_of_transport"] for gait in good], "o-", color=MODEL, label="model")
        _plot_engine_costs(cost, good)
        mark_values(cost, [gait.at for gait in gaits if not gait.point.feasible], "infeasible")
        cost.set_ylabel("cost of transport\nP / (m g v)")
        cost.set_ylim(bottom=0.0)
        cost.legend()
        lengths.plot(at, [1000.0 * gait.indexes["step_length_m"] for gait in good], "o-", color=MODEL)
        lengths.set_ylabel("step\n[mm]")
        lengths.set_ylim(bottom=0.0)
        for time, colour in zip(problem.display.durations, (LEFT, RIGHT), strict=True):
            phase = name_in_words(time, "s").removesuffix(" time")  # for example "single support"
            times.plot(at, [gait.point.x[time] for gait in good], "o-", color=colour, label=phase)
        times.set_ylabel("time [s]")
        times.set_ylim(bottom=0.0)
        times.legend(ncols=2)
        times.set_xlabel(make_axis_label(name, list_units(problem)[name]))
    return figure


def _plot_engine_costs(axes: Axes, gaits: Sequence[Gait]) -> None:
    """Energy of the simulated walks over the distance that they really covered."""
    points = [
        (gait.at, gait.walk.engine_J_per_m / gait.indexes["energy_J_per_m"] * gait.indexes["cost_of_transport"])
        for gait in gaits
        if gait.walk is not None and gait.walk.engine_J_per_m is not None
    ]
    if points:
        axes.plot(*zip(*points, strict=True), "s--", color=ENGINE, label="engine")
    fallen = [gait.at for gait in gaits if gait.walk is not None and gait.walk.measurements.fallen]
    mark_values(axes, fallen, "falls", "v", RIGHT, 0.1)


def plot_cycle(result: Result) -> Drawing:
    """Plot two steps of a cycle: hip and feet from the side and from above, and the angles of the left leg."""
    problem = result.problem
    assert problem.display.simulation_model is not None  # a cycle can be simulated; for the type checker
    robot = problem.display.simulation_model.robot
    signals = repeat_steps(sample_finely(result), robot, STEPS_SHOWN)
    leg = [joint.name for joint in reversed(robot.path_to_root(robot.feet["left"].link))]
    arrays, t, hip = signals.arrays, signals.arrays["t"], 1000.0 * signals.arrays["hip"]
    durations = [float(result.x[problem.variable_index(name)]) for name in problem.display.durations]
    switches = np.cumsum([0.0] + durations * STEPS_SHOWN)
    with use_style():
        figure = make_figure(6.3, 7.2)
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
