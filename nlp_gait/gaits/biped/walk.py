"""A whole walk from standing to standing: weight shift, first half step, steps, last half step, weight shift.

A straight walk is one along equal footholds, whose distance is a variable; its inner steps are one cycle (``walk_sections.py``).
Other footholds are given, so that a walk can turn: each step then has its own states, and the torso's yaw is the mean of both
feet's. Hip, feet and joints have continuous positions and velocities for any x.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError, check_count
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Grid, Point, Signals, SolverHints, Variable
from nlp_gait.formulation.assembly import InstantPoint, NumericPoint, Parameter, make_parameters
from nlp_gait.gaits.biped.body import LIFT, RIGHT_YAW, TIMES, TORSO_YAW, Body, Support, make_lift_variable
from nlp_gait.gaits.biped.cycle import STEP, PhaseMotion, make_cycle_margins, make_planner
from nlp_gait.gaits.biped.footholds import Flight, Foothold, list_feet
from nlp_gait.gaits.biped.limits import BalanceMargins, RowsAndMetrics
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import make_gait_problem, make_phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Planner
from nlp_gait.gaits.biped.sequence import End, MotionSection, read_state
from nlp_gait.gaits.biped.sequence import Sequence as PhaseSequence
from nlp_gait.gaits.biped.support_phases import (
    compute_sole_margins,
    limit_to_box,
    limit_to_hull,
    limit_to_sole,
    make_support_box,
)
from nlp_gait.gaits.biped.walk_sections import (
    DURATION,
    HALF_STEPS,
    STAND,
    list_equal_footholds,
    list_sections,
    make_phase_variables,
    make_walk_start,
    make_walk_variables,
)
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, parabola_lift, stack

MOST_STEPS = 1000
NO_LIMIT = 100.0  # [m/s]
STEPS = "step_count"  # parameter, so that compiled functions suit walks of any length
# Last variables of a phase: the right foot's foothold at both ends, seen from the left foot; of a straight walk x alone.
RIGHT = tuple(f"right_{end}_{what}" for end in ("from", "to") for what in ("x_m", "y_m", "yaw_rad"))
# Of the sole in x and y, least distance of the ZMP from its edges in single support between given footholds: without it, JVRC-1
# falls after a turn.
LEAST_SHARE = 1 / 4


def name_speed(end: str, prefix: str = "") -> str:
    """Return the name of the parameter that limits the speed of inner steps; ``end`` is least or greatest."""
    return f"{prefix}{end}_speed_m_s"


@dataclass(frozen=True, kw_only=True, eq=False)
class WholeWalk(PhaseSequence):
    """A walk sampled over its distinct phases; inner steps of a straight one are counted as often as they occur."""

    feet: tuple[Foothold, ...]  # right and left foot at the start, then where each step lands
    equal: bool  # whether the walk is straight: footholds are in step lengths, and inner steps are one cycle
    flight: Flight | None = None  # of stairs, one tread for each step length

    @property
    def steps(self) -> int:
        """Number of swings, the half steps included."""
        return len(self.feet) - 2

    @property
    def rise_m(self) -> float:
        """Height that each step gains."""
        return 0.0 if self.flight is None else self.flight.rise_m

    def _get_scale(self, point: Any) -> Any:
        """Return the unit of the footholds' x [m]."""
        return point[STEP] if self.equal else 1.0

    @property
    def inner_steps(self) -> dict[str, tuple[MotionSection, MotionSection]]:
        """Single and double support of each distinct inner step, by what their names begin with."""
        pairs = zip(self.sections, self.sections[1:], strict=False)
        swings = [(single, double) for single, double in pairs if single.kind is Support.SINGLE]
        return {single.name.removesuffix(Support.SINGLE): (single, double) for single, double in swings[1:-1]}

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases; those of balance begin with the kind of the phase."""
        steps = (STEPS, "1", float(self.steps), "number of steps; set by the option steps", self.steps, self.steps)
        speeds = [
            (name_speed(end, prefix), "m/s", limit, f"{end} speed of {words}", 0.0, NO_LIMIT)
            for end, limit in (("least", 0.0), ("greatest", NO_LIMIT))
            for prefix in self.inner_steps
            for words in (prefix.rstrip("_") or "the inner steps",)
        ]
        bounds_last = sorted(self.phase_parameters, key=lambda p: p.name.endswith((".lower", ".upper")))
        return (*make_parameters(steps, *speeds), *bounds_last)

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return energy per metre, rows and metrics."""
        sections = self.assemble_sections(point, ops)
        inner = point[STEPS] - HALF_STEPS
        often = {section.name: inner if section.name in TIMES else 1 for section in self.sections if section.occurs}
        energy, duration = (
            sum((values[name] * count for name, count in often.items()), MX(0))
            for values in (sections.energies, sections.times)
        )
        # The mean of the lengths of both feet's paths.
        swings = [section for section in self.sections if section.kind is Support.SINGLE]
        advance = sum((compute_advance(swing) * often[swing.name] for swing in swings), MX(0))
        distance = advance * self._get_scale(point)
        speeds, metrics = self._limit_speeds(point, sections.times, sections.energies)
        return Assembly(
            objective=energy / distance,
            constraints=(*sections.rows, *speeds),
            metrics={
                "energy_J": energy,
                "distance_m": distance,
                "duration_s": duration,
                "energy_J_per_m": energy / distance,
                **metrics,
                **sections.metrics,
            },
        )

    def _limit_speeds(self, point: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndMetrics:
        """Return rows of the inner steps: what both feet advance on average in a swing and the double support after it."""
        rows, metrics = list[Constraint](), dict[str, MX]()
        for prefix, pair in self.inner_steps.items():
            time, energy = (sum((values[section.name] for section in pair), MX(0)) for values in (times, energies))
            advance = compute_advance(pair[0]) * self._get_scale(point)
            least, greatest = (point[name_speed(end, prefix)] for end in ("least", "greatest"))
            row = Constraint(
                name=f"{prefix}speed", unit="m/s", scale=0.01, value=advance / time, lower=least, upper=greatest
            )
            rows.append(replace(row, over="once"))
            if self.equal:
                metrics = {"speed_m_s": advance / time, "cycle_energy_J_per_m": energy / advance}
        return rows, metrics

    def limit_section(self, section: MotionSection) -> Phase:
        """Return the phase with the limits of a section: between given footholds, the ZMP is in the hull of both soles."""
        phase = self.phases[section.kind]
        if section.kind is not Support.DOUBLE or self.equal:
            return phase
        hull = limit_to_hull(self.body, section.feet[1].outline(self.body.robot.feet["right"]))
        return replace(
            phase, limits=tuple(hull if isinstance(limit, BalanceMargins) else limit for limit in phase.limits)
        )

    def read_section(self, section: MotionSection, point: Any) -> Any:
        """Return the point of one phase: its own variables, see ``make_phase_variables``, from those of the walk."""
        scale = self._get_scale(point)
        lifted, landed = (foot._replace(x=foot.x * scale) for foot in section.feet)
        values = [value for end in (section.begin, section.end) for value in self._read_end(end, landed, point)]
        lift = point[section.lift] if section.kind is Support.SINGLE else 0.0
        right = (lifted.x, landed.x) if self.equal else (*lifted, *landed)
        x = ca.vertcat(*values, lift, ca.fmax(point[section.duration], LEAST_DURATION), *right)
        names = self.phases[Support.SINGLE].names
        parameters = {name: place for name, place in point.positions.items() if place[0] == "p"}
        return replace(point, x=x, positions=parameters | {name: ("x", i) for i, name in enumerate(names)})

    def _read_end(self, end: End, landed: Foothold, point: NumericPoint) -> list[Any]:
        """Values of a state in the order of ``make_state_variables``, seen from the standing foot."""
        coordinates, left_y = self.body.coordinates, self.body.feet_y[0]
        if end.state is None:  # between both feet, in the mean of their directions
            symmetric = [point[f"{c.name}_{STAND}_rad"] if c.mirror_sign > 0 else 0 for c in coordinates]
            ahead = landed._replace(yaw=landed.yaw / 2).turn(point[f"hip_x_{STAND}_m"], 0.0)
            place = [middle / 2 + offset for middle, offset in zip((landed.x, landed.y + left_y), ahead, strict=True)]
            return [*place, point[f"hip_z_{STAND}_m"], 0, 0, 0, *(v for angle in symmetric for v in (angle, 0))]
        x, y, z, vx, vy, vz, *angles = (point[v.name] for v in end.state.make_variables(self.body))
        if not end.mirrored:
            return [x, y, z, vx, vy, vz, *angles]
        signs = [c.mirror_sign for c in coordinates for _ in range(2)]
        (place_x, place_y), velocity = landed.turn(x, left_y - y), landed.turn(vx, -vy)
        mirrored = (sign * angle for sign, angle in zip(signs, angles, strict=True))
        return [landed.x + place_x, landed.y + place_y, z + self.rise_m, *velocity, vz, *mirrored]

    def signals(self, point: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""
        places, scale = [], float(self._get_scale(point))
        for k, stance in enumerate(self.feet[1:-1]):
            x, y = stance.turn(0.0, -self.body.feet_y[k % 2])
            places.append((scale * (stance.x + x), stance.y + y, k * self.rise_m, stance.yaw))
        return join_steps(self.list_step_signals(point), self.body.robot, np.array(places))


def compute_advance(swing: MotionSection) -> float:
    """Return half the way of a swinging foot, in the unit of its footholds."""
    lifted, landed = swing.feet
    return math.dist(lifted[:2], landed[:2]) / 2


def make_walk_planner(
    body: Body, right: Sequence[str], *, swings: bool, turning: bool, flight: Flight | None
) -> Planner:
    """Return the plan of a phase over the left foot: the right one swings straight to its foothold, or stands on it.

    Its places at both ends are the variables ``right``.
    """
    _, height = body.ankle("R")
    straight = len(right) == 2

    def read(point: InstantPoint, phase: SX) -> PhaseMotion:
        begin, end = (read_state(point, name, body.coordinates) for name in ("begin", "end"))
        half, duration = len(right) // 2, point[DURATION]
        lifted, landed = ([point[name] for name in names] for names in (right[:half], right[half:]))
        share, rise = constant_motion(1.0), constant_motion(0.0 if flight is None else flight.slope * landed[0])
        if swings and flight is not None:
            share, rise = flight.swing(lifted[0], landed[0], point[LIFT], duration, phase)
        elif swings:
            share = cubic(SX(0), SX(1), SX(0), SX(0), duration, phase)
            rise = parabola_lift(share, 0.0, 1.0, point[LIFT])
        x, *others = (
            Motion(a + (b - a) * share[0], *((b - a) * s for s in share[1:]))
            for a, b in zip(lifted, landed, strict=True)
        )
        y, yaw = (constant_motion(body.feet_y[1]), constant_motion(0.0)) if straight else others
        foot = stack(x, y, rise._replace(position=rise.position + height))
        turns = {TORSO_YAW: Motion(*(order / 2 for order in yaw)), RIGHT_YAW: yaw} if turning else {}
        return PhaseMotion(begin, end, duration, foot, turns)

    return make_planner(body, read)


def plan_straight_walk(body: Body, steps: int, grid: Grid, flight: Flight | None = None) -> GaitProblem:
    """Return the problem of a straight walk of least energy per metre, up a flight of stairs if it is given."""
    steps = check_count("steps", steps, at_least=HALF_STEPS, at_most=MOST_STEPS)
    footholds, right = list_equal_footholds(steps, body.feet_y), tuple(name for name in RIGHT if name.endswith("x_m"))
    walk = _make_walk(body, footholds, make_cycle_margins(body, right[1]), right, grid, flight)
    if flight is None:
        return make_walk_problem(walk)
    flight.check_run(next(variable.upper for variable in walk.variables if variable.name == STEP))
    variables = tuple(_raise_lift(v, body, flight) for v in walk.variables)
    return make_walk_problem(replace(walk, variables=variables)).fix(**{STEP: flight.run_m})


def plan_footstep_walk(body: Body, footholds: tuple[Foothold, ...], steps: int, grid: Grid) -> GaitProblem:
    """Return the problem of a walk along given footholds, the right foot's first, with least energy per metre."""
    if steps != len(footholds):
        raise InputError(f"steps must be the number of footholds, {len(footholds)}, got {steps}")
    left_xy, least = (0.0, body.feet_y[0]), compute_sole_margins(body.robot.feet["left"], (LEAST_SHARE, LEAST_SHARE))
    side = Foothold(0.0, body.feet_y[1], 0.0).outline(body.robot.feet["right"])
    margins = {Support.SINGLE: limit_to_sole(body, left_xy, least), Support.DOUBLE: limit_to_hull(body, side)}
    return make_walk_problem(_make_walk(body, footholds, margins, RIGHT, grid))


def _make_walk(
    body: Body,
    footholds: tuple[Foothold, ...],
    margins: Mapping[Support, BalanceMargins],
    right: tuple[str, ...],
    grid: Grid,
    flight: Flight | None = None,
) -> WholeWalk:
    """Return a walk; ``margins`` are those of single and double support, ``right`` the last variables of its phases."""
    turning, equal = any(foothold.yaw for foothold in footholds), right != RIGHT
    loads = make_divided_loads(body, "lever")
    body = replace(body, upright=frozenset()) if turning else body  # a swinging foot turns
    box = make_support_box(body.robot, {side: (0.0, body.ankle(side)[0]) for side in "LR"})
    plans = [make_walk_planner(body, right, swings=swings, turning=turning, flight=flight) for swings in (False, True)]
    fields: dict[str, Any] = {"variables": make_phase_variables(body, right), "duration": DURATION, "grid": grid}
    phases = {
        kind: make_phase(body, kind, balance, loads, plan=plans[kind is Support.SINGLE], **fields)
        for kind, balance in {**margins, Support.STAND: limit_to_box(box)}.items()
    }
    sections = list_sections(footholds, body.feet_y, equal=equal)
    return WholeWalk(
        body=body,
        variables=make_walk_variables(body, sections, equal=equal),
        phases=phases,
        sections=tuple(sections),
        feet=list_feet(footholds, body.feet_y),
        equal=equal,
        flight=flight,
    )


def _raise_lift(variable: Variable, body: Body, flight: Flight) -> Variable:
    """Return the height of a swing with the bounds that the stairs' edges need; other variables as they are."""
    if not variable.name.endswith(LIFT):
        return variable
    least = flight.find_least_lift(2 if variable.name == LIFT else 1)
    return replace(variable, lower=least, upper=round(least + make_lift_variable(body).upper, 4))


def make_walk_problem(walk: WholeWalk) -> GaitProblem:
    """Return the problem of a walk."""
    hints = SolverHints(start=make_walk_start(walk.body, walk.variables, walk.sections), starts=3, searchable=False)
    treads = () if walk.flight is None else walk.flight.list_treads(walk.steps - 1)
    title = "walk from standing to standing: least energy per metre"
    ground = None if walk.flight is None else lambda _: treads
    return make_gait_problem(walk, "walk", title, hints, steps=walk.steps, ground=ground)
