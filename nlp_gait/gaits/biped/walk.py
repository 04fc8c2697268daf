"""A whole walk from standing to standing: weight shift, first half step, steps, last half step, weight shift.

All inner steps are the same cycle, whose states at both switches are variables; the start ends in the cycle's state, and the stop
begins there. So the size of the problem does not depend on the number of steps, and hip, feet and joints have continuous
positions and velocities for any x. A walk of two half steps has no inner step, and neither variables nor rows of one.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import check_count
from nlp_gait.formulation import Assembly, Constraint, Display, GaitProblem, Grid, Point, Signals, SolverHints, Variable
from nlp_gait.formulation.assembly import InstantPoint, NumericPoint, Parameter, RowsOverTime, make_parameters
from nlp_gait.formulation.display import Tread
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body
from nlp_gait.gaits.biped.cycle import make_cycle_margins
from nlp_gait.gaits.biped.cycle_motion import STEP, PhaseMotion, make_planner, make_state_variables, read_state
from nlp_gait.gaits.biped.flight import Flight
from nlp_gait.gaits.biped.joined_phases import (
    ENERGY_PER_METRE,
    STAND,
    assemble_part,
    collect_parameters,
    join_phases,
    list_rows_over_time,
)
from nlp_gait.gaits.biped.limits import RowsAndIndexes
from nlp_gait.gaits.biped.load_sharing import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import add_robot, make_goal, make_phase_limits
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Loader, Planner, Samples
from nlp_gait.gaits.biped.support_phases import limit_to_box, make_single_support_loads, make_support_box
from nlp_gait.gaits.biped.walk_parts import (
    CYCLE_END,
    DURATION,
    GREATEST_SPEED,
    HALF_STEPS,
    LEAST_SPEED,
    PARTS,
    RIGHT_FROM,
    STAND_AT_END,
    Part,
    make_phase_variables,
    make_walk_variables,
    start_walk,
)
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth

MOST_STEPS = 1000
NO_LIMIT = 100.0  # [m/s]
STEPS = "step_count"  # parameter, so that compiled functions suit walks of any length


@dataclass(frozen=True, kw_only=True, eq=False)
class WholeWalk:
    """A walk sampled over its distinct phases; inner steps are counted as often as they occur."""

    body: Body
    steps: int  # swings, the half steps included
    variables: tuple[Variable, ...]
    phases: Mapping[str, Phase]  # by kind
    flight: Flight | None = None  # of stairs, one tread for each step length

    @property
    def rise_m(self) -> float:
        """Height that each step gains."""
        return 0.0 if self.flight is None else self.flight.rise_m

    @cached_property
    def parts(self) -> dict[str, Part]:
        """The phases that it consists of: without those of the inner steps if there are none."""
        return {name: part for name, part in PARTS.items() if self.steps > HALF_STEPS or name not in TIMES}

    @property
    def counts(self) -> dict[str, int]:
        """How often each part occurs in the walk."""
        often = {STAND: 0, STAND_AT_END: 0, "ssp": self.steps - HALF_STEPS, "dsp": self.steps - HALF_STEPS}
        return {name: often.get(name, 1) for name in self.parts}

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases; those of balance begin with the kind of the phase."""
        count = make_parameters(
            (STEPS, "1", float(self.steps), "number of steps; set by the option steps", self.steps, self.steps)
        )
        found = collect_parameters(self.phases)
        return (*count, *self.speed_limits, *sorted(found, key=lambda p: p.name.endswith((".lower", ".upper"))))

    @property
    def speed_limits(self) -> tuple[Parameter, ...]:
        """Parameters of the inner steps' speed."""
        if "ssp" not in self.parts:
            return ()
        return make_parameters(
            (LEAST_SPEED, "m/s", 0.0, "least speed of the inner steps", 0.0, NO_LIMIT),
            (GREATEST_SPEED, "m/s", NO_LIMIT, "greatest speed of the inner steps (no limit by default)", 0.0, NO_LIMIT),
        )

    def assemble(self, at: Point, ops: Nonsmooth) -> Assembly:
        """Return energy per metre, rows and indexes."""
        parts = self.parts
        points = {name: self.read_part(name, at) for name in parts}
        samples: dict[str, Samples] = {}
        for kinds in (("ssp",), ("dsp", STAND)):  # double support differs in its limits only
            names = [name for name, part in parts.items() if part.kind in kinds]
            several = self.phases[kinds[0]].sample_several([points[name] for name in names], ops)
            samples |= dict(zip(names, several, strict=True))
        found = {
            name: assemble_part(name, part.kind, self.limit_phase(name), points[name], samples[name], ops)
            for name, part in parts.items()
        }
        times = {name: point[DURATION] for name, point in points.items()}
        energies = {name: found[name].indexes[f"{name}_power_W"] * times[name] for name in parts}
        inner = at[STEPS] - HALF_STEPS
        energy, duration = (
            sum((part[name] * (inner if name in TIMES else 1) for name in parts if not name.startswith(STAND)), MX(0))
            for part in (energies, times)
        )
        distance = self.find_distance(at, inner)
        speeds, indexes = self.limit_speed(at, times, energies)
        return Assembly(
            objective=energy / distance,
            constraints=(*(row for part in found.values() for row in part.constraints), *speeds),
            indexes={
                "energy_J": energy,
                "distance_m": distance,
                "duration_s": duration,
                "energy_J_per_m": energy / distance,
                **indexes,
                **{name: value for part in found.values() for name, value in part.indexes.items()},
            },
        )

    def find_distance(self, at: Point, inner: MX) -> MX:
        """Return the distance that the feet advance with so many inner steps [m]."""
        return (inner + 1) * at[STEP]

    def limit_phase(self, name: str) -> Phase:
        """Return the phase with the limits of a part."""
        return self.phases[self.parts[name].kind]

    def limit_speed(self, at: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndIndexes:
        """Return the row and the indexes of the inner steps."""
        if "ssp" not in self.parts:
            return (), {}
        speed = at[STEP] / (times["ssp"] + times["dsp"])
        row = make_speed_row("speed", speed, at[LEAST_SPEED], at[GREATEST_SPEED])
        cost = (energies["ssp"] + energies["dsp"]) / at[STEP]
        return (row,), {"speed_m_s": speed, "cycle_energy_J_per_m": cost}

    def read_part(self, name: str, at: NumericPoint) -> NumericPoint:
        """Return the point of one phase: its own variables, see ``make_phase_variables``, from those of the walk."""
        part = self.parts[name]
        values = [value for state in (part.begin, part.end) for value in self._read_state(state, part, at)]
        values += [at[part.lift] if part.kind == "ssp" else 0.0, ca.fmax(at[part.duration], LEAST_DURATION)]
        x = ca.vertcat(*values, *self._place_right_foot(part, at))
        parameters = {name: place for name, place in at.positions.items() if place[0] == "p"}
        return replace(at, x=x, positions=parameters | {n: ("x", i) for i, n in enumerate(self.phases["ssp"].names)})

    def _place_right_foot(self, part: Part, at: NumericPoint) -> list[MX | float]:
        step = at[STEP]
        return [share * step for share in part.feet]

    def _read_state(self, state: str, part: Part, at: NumericPoint) -> list[MX | float]:
        """Values of a state in the order of ``make_state_variables``."""
        coordinates = self.body.coordinates
        if state == STAND:
            symmetric = [at[f"{c.name}_{STAND}_rad"] if c.image > 0 else 0 for c in coordinates]
            return [at[f"hip_x_{STAND}_m"], 0, at[f"hip_z_{STAND}_m"], 0, 0, 0, *(v for a in symmetric for v in (a, 0))]
        names = [variable.name for variable in make_state_variables(self.body, "lift_off", "lift_off")]
        if state != CYCLE_END:
            return [at[name.replace("lift_off", state)] for name in names]
        x, y, z, vx, vy, vz, *angles = (at[name] for name in names)  # the mirror image of lift-off, a step further
        images = [c.image for c in coordinates for _ in range(2)]
        return [x + at[STEP], -y, z + self.rise_m, vx, -vy, vz, *(i * a for i, a in zip(images, angles, strict=True))]

    @property
    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """All phases as functions of time; of the inner steps the first one."""
        counts = self.counts
        parts = ((name, part.kind, part.duration, counts[name]) for name, part in self.parts.items())
        return list_rows_over_time(parts, self.phases, self.read_part)

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""

        def join(*names: str) -> Signals:
            return join_phases(self.phases[PARTS[name].kind].signals(self.read_part(name, at)) for name in names)

        inner = [join("ssp", "dsp")] * (self.steps - HALF_STEPS) if "ssp" in self.parts else []
        steps = [join("shift", "start_ssp", "start_dsp"), *inner, join("stop_ssp", "stop_dsp")]
        return join_steps(steps, self.body.robot, np.outer(range(self.steps), [float(at[STEP]), 0.0, self.rise_m, 0.0]))


def make_speed_row(name: str, speed: MX, least: MX, greatest: MX) -> Constraint:
    """Return the row that keeps a speed between limits [m/s]."""
    return Constraint(name=name, unit="m/s", scale=0.01, value=speed, lower=least, upper=greatest, over="once")


def make_walk_phases(
    body: Body, variables: tuple[Variable, ...], planners: Sequence[Planner], grid: Grid, loads: Loader
) -> dict[str, Phase]:
    """Return the phases by kind; planners are those of a right foot that stands, with loads, and of one that swings."""
    margins, goal = make_cycle_margins(body), make_goal(body, "power")
    box = make_support_box(body.robot, {"L": (0.0, body.feet_y[0]), "R": (0.0, body.feet_y[1])})
    return {
        kind: Phase(
            body=body,
            variables=variables,
            duration=DURATION,
            plan=planners[kind == "ssp"],
            loads=make_single_support_loads(body) if kind == "ssp" else loads,
            grid=grid,
            limits=(*make_phase_limits(body, own), *body.motors.limits),
            goal=goal,
            standing=("L",) if kind == "ssp" else ("L", "R"),
        )
        for kind, own in {"ssp": margins["ssp"], "dsp": margins["dsp"], STAND: limit_to_box(box)}.items()
    }


def _raise_lift(variable: Variable, body: Body, flight: Flight) -> Variable:
    """Return the height of a swing with the bounds that the stairs' edges need; other variables as they are."""
    if not variable.name.endswith(LIFT):
        return variable
    least = flight.find_least_lift(2 if variable.name == LIFT else 1)
    return replace(variable, lower=least, upper=round(least + body.lift_variable.upper, 4))


def plan_whole_walk(body: Body, steps: int, grid: Grid, flight: Flight | None = None) -> GaitProblem:
    """Return the problem of a whole walk of least energy per metre; for the options see ``gaits.nao``."""

    def read(at: InstantPoint, swings: bool) -> PhaseMotion:
        begin, end = (read_state(at, name, body.coordinates) for name in ("begin", "end"))
        return PhaseMotion(begin, end, at[DURATION], at[RIGHT_FROM], at[STEP], at[LIFT] if swings else None)

    steps = check_count("steps", steps, at_least=HALF_STEPS, at_most=MOST_STEPS)
    planners = [make_planner(body, partial(read, swings=swings), flight) for swings in (False, True)]
    phases = make_walk_phases(body, make_phase_variables(body), planners, grid, make_divided_loads(body, "lever"))
    variables = make_walk_variables(body, steps)
    if flight is None:
        return make_walk_problem(WholeWalk(body=body, steps=steps, variables=variables, phases=phases), variables)
    flight.check_run(next(variable.upper for variable in variables if variable.name == STEP))
    variables = tuple(_raise_lift(v, body, flight) for v in variables)
    treads = flight.list_treads(steps - 1)
    walk = WholeWalk(body=body, steps=steps, variables=variables, phases=phases, flight=flight)
    return make_walk_problem(walk, variables, lambda at, count: treads).fix(**{STEP: flight.run_m})


def make_walk_problem(
    walk: WholeWalk, started: Sequence[Variable], ground: Callable[[NumericPoint, int], tuple[Tread, ...]] | None = None
) -> GaitProblem:
    """Return the problem of a walk; start points are shares of the bounds of the variables ``started``."""
    body = walk.body
    start = partial(start_walk, [body.narrow(variable) for variable in started], math.tan(body.slope_rad))
    durations = tuple(walk.parts[name].duration for name, count in walk.counts.items() for _ in range(count))
    problem = GaitProblem(
        name=f"{body.family}-walk",
        title=f"{body.title}, walk from standing to standing: least energy per metre",
        variables=walk.variables,
        own_parameters=walk.parameters,
        objective=ENERGY_PER_METRE,
        assemble=walk.assemble,
        grid=walk.phases["ssp"].grid,
        rows_over_time=walk.rows_over_time if body.closed_form else (),
        display=Display(motion=walk.signals, durations=durations),
        hints=SolverHints(start=start, starts=3, searchable=False),
    )
    return add_robot(problem, body, steps=walk.steps, ground=ground)
