"""A whole walk from standing to standing: weight shift, first half step, steps, last half step, weight shift.

All inner steps are the same cycle, whose states at both switches are variables; the start ends in the cycle's state, and the stop
begins there. So the size of the problem does not depend on the number of steps, and hip, feet and joints have continuous
positions and velocities for any x. A walk of two half steps has no inner step, and neither variables nor rows of one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import check_count
from nlp_gait.formulation import (
    Array,
    Assembly,
    Constraint,
    GaitProblem,
    Grid,
    Point,
    Signals,
    SolverHints,
    Variable,
)
from nlp_gait.formulation.assembly import InstantPoint, NumericPoint, Parameter, make_parameters
from nlp_gait.formulation.display import Tread
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, Support
from nlp_gait.gaits.biped.bounds import make_lift_variable
from nlp_gait.gaits.biped.cycle import make_cycle_margins
from nlp_gait.gaits.biped.cycle_motion import STEP, PhaseMotion, make_planner
from nlp_gait.gaits.biped.flight import Flight
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.limits import BalanceMargins, RowsAndIndexes
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import make_gait_problem, make_goal, make_phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Loader, Planner
from nlp_gait.gaits.biped.sequence import CYCLE, End, MotionSection, Sequence
from nlp_gait.gaits.biped.support_phases import limit_to_box, make_support_box, swing_foot
from nlp_gait.gaits.biped.switch import read_state
from nlp_gait.gaits.biped.walk_sections import (
    DURATION,
    GREATEST_SPEED,
    HALF_STEPS,
    LEAST_SPEED,
    RIGHT_FROM,
    STAND,
    STATES,
    State,
    list_sections,
    make_phase_variables,
    make_walk_start,
    make_walk_variables,
)
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth

MOST_STEPS = 1000
NO_LIMIT = 100.0  # [m/s]
STEPS = "step_count"  # parameter, so that compiled functions suit walks of any length


@dataclass(frozen=True, kw_only=True, eq=False)
class WholeWalk(Sequence):
    """A walk sampled over its distinct phases; inner steps are counted as often as they occur."""

    steps: int  # swings, the half steps included
    states: tuple[State, ...] = STATES  # between its phases
    flight: Flight | None = None  # of stairs, one tread for each step length

    @property
    def rise_m(self) -> float:
        """Height that each step gains."""
        return 0.0 if self.flight is None else self.flight.rise_m

    @property
    def has_cycle(self) -> bool:
        """Whether inner steps are a cycle."""
        return any(section.name == Support.SINGLE for section in self.sections)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases; those of balance begin with the kind of the phase."""
        count = make_parameters(
            (STEPS, "1", float(self.steps), "number of steps; set by the option steps", self.steps, self.steps)
        )
        bounds_last = sorted(self.phase_parameters, key=lambda p: p.name.endswith((".lower", ".upper")))
        return (*count, *self.speed_limits, *bounds_last)

    @property
    def speed_limits(self) -> tuple[Parameter, ...]:
        """Parameters of the inner steps' speed."""
        if not self.has_cycle:
            return ()
        return make_parameters(
            (LEAST_SPEED, "m/s", 0.0, "least speed of the inner steps", 0.0, NO_LIMIT),
            (GREATEST_SPEED, "m/s", NO_LIMIT, "greatest speed of the inner steps (no limit by default)", 0.0, NO_LIMIT),
        )

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return energy per metre, rows and indexes."""
        sections = self.assemble_sections(point, ops)
        inner = point[STEPS] - HALF_STEPS
        often = {section.name: inner if section.name in TIMES else 1 for section in self.sections if section.occurs}
        energy, duration = (
            sum((values[name] * count for name, count in often.items()), MX(0))
            for values in (sections.energies, sections.times)
        )
        distance = self.find_distance(point, inner)
        speeds, indexes = self.limit_speed(point, sections.times, sections.energies)
        return Assembly(
            objective=energy / distance,
            constraints=(*sections.rows, *speeds),
            indexes={
                "energy_J": energy,
                "distance_m": distance,
                "duration_s": duration,
                "energy_J_per_m": energy / distance,
                **indexes,
                **sections.indexes,
            },
        )

    def find_distance(self, point: Point, inner: MX) -> MX:
        """Return the distance that the feet advance with so many inner steps [m]."""
        return (inner + 1) * point[STEP]

    def limit_speed(self, point: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndIndexes:
        """Return the row and the indexes of the inner steps."""
        if not self.has_cycle:
            return (), {}
        time, energy = (sum((values[section.name] for section in CYCLE), MX(0)) for values in (times, energies))
        row = make_speed_row("speed", point[STEP] / time, point[LEAST_SPEED], point[GREATEST_SPEED])
        return (row,), {"speed_m_s": point[STEP] / time, "cycle_energy_J_per_m": energy / point[STEP]}

    def read_section(self, section: MotionSection, point: Any) -> Any:
        """Return the point of one phase: its own variables, see ``make_phase_variables``, from those of the walk."""
        feet, landed = self.place_right_foot(section, point)
        values = [value for end in (section.begin, section.end) for value in self._read_end(end, landed, point)]
        lift = point[section.lift] if section.kind is Support.SINGLE else 0.0
        x = ca.vertcat(*values, lift, ca.fmax(point[section.duration], LEAST_DURATION), *feet)
        names = self.phases[Support.SINGLE].names
        parameters = {name: place for name, place in point.positions.items() if place[0] == "p"}
        return replace(point, x=x, positions=parameters | {name: ("x", i) for i, name in enumerate(names)})

    def place_right_foot(self, section: MotionSection, point: NumericPoint) -> tuple[list[Any], Foothold]:
        """Return the last variables of a section's phase, and where the right foot is at its end, seen from the left one."""
        begin, end = (share * point[STEP] for share in section.feet)
        return [begin, end], Foothold(end, self.body.feet_y[1], 0.0)

    def _read_end(self, end: End, landed: Foothold, point: NumericPoint) -> list[Any]:
        """Values of a state in the order of ``make_state_variables``, seen from the standing foot."""
        coordinates, left_y = self.body.coordinates, self.body.feet_y[0]
        if end.state is None:  # between both feet, in the mean of their directions
            symmetric = [point[f"{c.name}_{STAND}_rad"] if c.image > 0 else 0 for c in coordinates]
            ahead = landed._replace(yaw=landed.yaw / 2).turn(point[f"hip_x_{STAND}_m"], 0.0)
            place = [middle / 2 + offset for middle, offset in zip((landed.x, landed.y + left_y), ahead, strict=True)]
            return [*place, point[f"hip_z_{STAND}_m"], 0, 0, 0, *(v for angle in symmetric for v in (angle, 0))]
        x, y, z, vx, vy, vz, *angles = (point[v.name] for v in self.states[end.state].make_variables(self.body))
        if not end.mirrored:
            return [x, y, z, vx, vy, vz, *angles]
        images = [c.image for c in coordinates for _ in range(2)]
        (place_x, place_y), velocity = landed.turn(x, left_y - y), landed.turn(vx, -vy)
        mirrored = (image * angle for image, angle in zip(images, angles, strict=True))
        return [landed.x + place_x, landed.y + place_y, z + self.rise_m, *velocity, vz, *mirrored]

    def place_steps(self, point: NumericPoint) -> Array:
        """Return the places (K, 4) of the standing feet: x, y, z [m] and yaw [rad]."""
        return np.outer(range(self.steps), [float(point[STEP]), 0.0, self.rise_m, 0.0])

    def signals(self, point: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""
        return join_steps(self.list_step_signals(point), self.body.robot, self.place_steps(point))


def make_speed_row(name: str, speed: MX, least: MX, greatest: MX) -> Constraint:
    """Return the row that keeps a speed between limits [m/s]."""
    return Constraint(name=name, unit="m/s", scale=0.01, value=speed, lower=least, upper=greatest, over="once")


def make_walk_phases(
    body: Body,
    variables: tuple[Variable, ...],
    planners: list[Planner],
    margins: Mapping[Support, BalanceMargins],
    grid: Grid,
    loads: Loader,
) -> dict[Support, Phase]:
    """Return the phases by kind; planners are those of a right foot that stands, with loads, and of one that swings."""
    goal = make_goal(body, "power")
    box = make_support_box(body.robot, {"L": (0.0, body.feet_y[0]), "R": (0.0, body.feet_y[1])})
    balance = {**margins, Support.STAND: limit_to_box(box)}
    fields: dict[str, Any] = {"variables": variables, "duration": DURATION, "grid": grid, "goal": goal}
    return {
        kind: make_phase(body, kind, limit, loads, plan=planners[kind is Support.SINGLE], **fields)
        for kind, limit in balance.items()
    }


def _raise_lift(variable: Variable, body: Body, flight: Flight) -> Variable:
    """Return the height of a swing with the bounds that the stairs' edges need; other variables as they are."""
    if not variable.name.endswith(LIFT):
        return variable
    least = flight.find_least_lift(2 if variable.name == LIFT else 1)
    return replace(variable, lower=least, upper=round(least + make_lift_variable(body).upper, 4))


def plan_whole_walk(body: Body, steps: int, grid: Grid, flight: Flight | None = None) -> GaitProblem:
    """Return the problem of a whole walk of least energy per metre, up a flight of stairs if it is given."""
    swing, slope = (swing_foot, 0.0) if flight is None else (flight.swing, flight.slope)

    def read(point: InstantPoint, phase: SX, swings: bool) -> PhaseMotion:
        begin, end = (read_state(point, name, body.coordinates) for name in ("begin", "end"))
        step, duration = point[STEP], point[DURATION]
        foot = body.standing_ankle("R", step, slope * step)
        if swings:
            foot = swing(point[RIGHT_FROM], step, *body.ankle("R"), point[LIFT], duration, phase)
        return PhaseMotion(begin, end, duration, foot)

    steps = check_count("steps", steps, at_least=HALF_STEPS, at_most=MOST_STEPS)
    planners = [make_planner(body, partial(read, swings=swings)) for swings in (False, True)]
    margins, loads = make_cycle_margins(body), make_divided_loads(body, "lever")
    phases = make_walk_phases(body, make_phase_variables(body), planners, margins, grid, loads)
    variables = make_walk_variables(body, steps)
    walk = WholeWalk(
        body=body, steps=steps, variables=variables, phases=phases, sections=list_sections(steps), flight=flight
    )
    if flight is None:
        return make_walk_problem(walk, variables)
    flight.check_run(next(variable.upper for variable in variables if variable.name == STEP))
    variables = tuple(_raise_lift(v, body, flight) for v in variables)
    treads = flight.list_treads(steps - 1)
    return make_walk_problem(replace(walk, variables=variables), variables, lambda point: treads).fix(
        **{STEP: flight.run_m}
    )


def make_walk_problem(
    walk: WholeWalk,
    started: tuple[Variable, ...],
    ground: Callable[[NumericPoint], tuple[Tread, ...]] | None = None,
) -> GaitProblem:
    """Return the problem of a walk; start points are shares of the bounds of the variables ``started``."""
    start = make_walk_start(walk.body, started, walk.states, walk.sections)
    hints = SolverHints(start=start, starts=3, searchable=False)
    title = "walk from standing to standing: least energy per metre"
    return make_gait_problem(walk, "walk", title, hints, steps=walk.steps, ground=ground)
