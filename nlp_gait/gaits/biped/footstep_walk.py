"""A walk from standing to standing along given footholds: each step has its own states, so that it can turn and change.

Each step is seen from its standing foot, mirrored if that is the right one: a left foot at x = 0 that points forward, and a right
foot that swings from foothold to foothold. The torso's yaw is the mean of both feet's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, InstantPoint, NumericPoint, Parameter, Point
from nlp_gait.formulation.assembly import Variable, make_parameters
from nlp_gait.gaits.biped.body import LIFT, RIGHT_YAW, TIMES, TORSO_YAW, Body, Support
from nlp_gait.gaits.biped.cycle_motion import PhaseMotion, make_cycle_variables, make_planner
from nlp_gait.gaits.biped.footholds import Foothold, find_support_sides, list_feet, list_swings
from nlp_gait.gaits.biped.limits import BalanceMargins, Margins, RowsAndIndexes
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Planner
from nlp_gait.gaits.biped.sequence import End, MotionSection
from nlp_gait.gaits.biped.support_phases import compute_sole_margins, limit_to_sole
from nlp_gait.gaits.biped.switch import SWITCHES, read_state
from nlp_gait.gaits.biped.walk import NO_LIMIT, WholeWalk, make_speed_row, make_walk_phases, make_walk_problem
from nlp_gait.gaits.biped.walk_sections import DURATION, SHIFT, STAND, State, make_phase_variables, make_pose_variables
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, parabola_lift, stack

STAND_AT_END = "stand_at_end"
# Last variables of a phase: the right foot's foothold at both ends, seen from the left foot.
RIGHT = tuple(f"right_{end}_{what}" for end in ("from", "to") for what in ("x_m", "y_m", "yaw_rad"))
BESIDE = 1e-6  # [m, rad]; feet this close to their places at the start stand side by side
# Of the sole in x and y, least distance of the ZMP from its edges in single support: without it, JVRC-1 falls after a turn.
LEAST_SHARE = 1 / 4
LEAST_SLANT = 1e-2  # component of a side's normal along an axis, below which there is no distance to the side along it


@dataclass(frozen=True, kw_only=True, eq=False)
class FootstepWalk(WholeWalk):
    """A walk along footholds, sampled over all its phases."""

    feet: tuple[Foothold, ...]  # right and left foot at the start, then where each step lands

    @property
    def advances(self) -> list[float]:
        """Half the way of each step's foot [m]."""
        return [math.dist(a[:2], b[:2]) / 2 for a, b in zip(self.feet, self.feet[2:], strict=False)]

    def find_distance(self, point: Point, inner: MX) -> MX:
        """Return the mean of the lengths of both feet's paths [m]."""
        return MX(sum(self.advances))

    @property
    def speed_limits(self) -> tuple[Parameter, ...]:
        """Parameters of each inner step's speed."""
        steps = [
            (end, limit, k) for end, limit in (("least", 0.0), ("greatest", NO_LIMIT)) for k in range(2, self.steps)
        ]
        rows = (
            (name_speed(end, k), "m/s", limit, f"{end} speed of step {k}", 0.0, NO_LIMIT) for end, limit, k in steps
        )
        return make_parameters(*rows)

    def limit_speed(self, point: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndIndexes:
        """Return the rows of the inner steps: what both feet advance on average in a swing and the double support after it."""
        rows = []
        for k in range(2, self.steps):
            speed = self.advances[k - 1] / (times[f"step{k}_ssp"] + times[f"step{k}_dsp"])
            least, greatest = (point[name_speed(end, k)] for end in ("least", "greatest"))
            rows.append(make_speed_row(f"step{k}_speed", speed, least, greatest))
        return rows, {}

    def limit_section(self, section: MotionSection) -> Phase:
        """Return the phase with the limits of a section: in double support, the ZMP is limited by the hull of both soles."""
        phase = self.phases[section.kind]
        if section.kind is not Support.DOUBLE:
            return phase
        stance = make_stance_margins(self.body, section.feet[1])
        limits = (stance if isinstance(limit, BalanceMargins) else limit for limit in phase.limits)
        return replace(phase, limits=tuple(limits))

    def place_right_foot(self, section: MotionSection, point: NumericPoint) -> tuple[list[Any], Foothold]:
        """Return the last variables of a section's phase, ``RIGHT``, and where the right foot is at its end."""
        begin, end = section.feet
        return [*begin, *end], end

    def place_steps(self, point: NumericPoint) -> Array:
        """Return the places (K, 4) of the standing feet: x, y, z [m] and yaw [rad]."""
        places = []
        for k, stance in enumerate(self.feet[1:-1], 1):
            x, y = stance.turn(0.0, -self.body.feet_y[(k + 1) % 2])
            places.append((stance.x + x, stance.y + y, 0.0, stance.yaw))
        return np.array(places)


def list_footstep_sections(body: Body, feet: tuple[Foothold, ...]) -> tuple[MotionSection, ...]:
    """Return all phases of a walk in the order of time; its states are lift-off and touch-down of each step."""
    swings = list_swings(feet[2:], body.feet_y)
    first = (swings[0][0],) * 2
    shift = MotionSection("shift", Support.STAND, End(), End(0), first, SHIFT)
    sections = [shift._replace(name=STAND, end=End(), occurs=0), shift]
    for k, (lifted, landed) in enumerate(swings):
        single, double, lift = (f"step{k + 1}_{name}" for name in (*TIMES.values(), LIFT))
        lift_off, touch_down, last = End(2 * k), End(2 * k + 1), k + 1 == len(swings)
        kind = Support.STAND if np.allclose(landed, first[0], atol=BESIDE) else Support.DOUBLE
        end, stance = End() if last else End(2 * k + 2, mirrored=True), (landed, landed)
        sections += [
            MotionSection(
                f"step{k + 1}_ssp", Support.SINGLE, lift_off, touch_down, (lifted, landed), single, lift, k + 1
            ),
            MotionSection(f"step{k + 1}_dsp", kind, touch_down, end, stance, double, step=k + 1),
        ]
    return (*sections, sections[-1]._replace(name=STAND_AT_END, begin=End(), occurs=0))


def list_states(steps: int) -> tuple[State, ...]:
    """Return the states of a walk of so many steps."""
    return tuple(State(f"step{k}_{switch}", switch) for k in range(1, steps + 1) for switch in SWITCHES)


def name_speed(end: str, step: int) -> str:
    """Return the name of the parameter that limits the speed of a step; ``end`` is least or greatest."""
    return f"step{step}_{end}_speed_m_s"


def make_stance_margins(body: Body, right: Foothold) -> BalanceMargins:
    """Return the limit of the ZMP to the hull of both soles; the mean margins are those of a single sole."""
    left, soles = Foothold(0.0, body.feet_y[0], 0.0), body.robot.feet
    sides = find_support_sides([left.outline(soles["left"]), right.outline(soles["right"])])
    return BalanceMargins(make_polygon_margins(sides), compute_sole_margins(soles["left"]))


def make_polygon_margins(sides: Array) -> Margins:
    """Return the balance margins in x and y: distances along the axes to the sides (n, 3) of a convex polygon."""

    def margins(zmp: MX, point: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        def measure(axis: int) -> MX:
            slanted = [side for side in sides.tolist() if abs(side[axis]) > LEAST_SLANT]
            return ops.min(*(((d - x * zmp[0, :] - y * zmp[1, :]) / abs((x, y)[axis])).T for x, y, d in slanted)).T

        return measure(0), measure(1)

    return margins


def make_footstep_planner(body: Body, turning: bool, swings: bool) -> Planner:
    """Return the plan of a phase over the left foot: the right one swings straight to its foothold, or stands on it."""
    _, height = body.ankle("R")

    def read(point: InstantPoint, phase: SX) -> PhaseMotion:
        begin, end = (read_state(point, name, body.coordinates) for name in ("begin", "end"))
        share, rise = constant_motion(1.0), constant_motion(0.0)
        if swings:
            share = cubic(SX(0), SX(1), SX(0), SX(0), point[DURATION], phase)
            rise = parabola_lift(share, 0.0, 1.0, point[LIFT])
        ends = zip(RIGHT[:3], RIGHT[3:], strict=True)
        x, y, yaw = (
            Motion(point[a] + (point[b] - point[a]) * share[0], *((point[b] - point[a]) * s for s in share[1:]))
            for a, b in ends
        )
        foot = stack(x, y, rise._replace(position=rise.position + height))
        turns = {TORSO_YAW: Motion(*(order / 2 for order in yaw)), RIGHT_YAW: yaw} if turning else {}
        return PhaseMotion(begin, end, point[DURATION], foot, turns)

    return make_planner(body, read)


def make_footstep_variables(body: Body, steps: int) -> tuple[Variable, ...]:
    """Return the variables of a walk of so many steps: the pose at both ends, and states, swing and times of each step."""
    of_cycle: Mapping[str, Variable] = {variable.name: variable for variable in make_cycle_variables(body)}
    variables = [
        *make_pose_variables(body),
        replace(of_cycle[TIMES[Support.DOUBLE]], name=SHIFT, description="duration of the phase shift"),
    ]
    states = list_states(steps)
    for k in range(1, steps + 1):
        for state in states[2 * k - 2 : 2 * k]:
            variables += state.make_variables(body)
        swing = (of_cycle[name] for name in (LIFT, *TIMES.values()))
        variables += [replace(v, name=f"step{k}_{v.name}", description=f"{v.description}, step {k}") for v in swing]
    return tuple(variables)


def plan_footstep_walk(body: Body, footholds: tuple[Foothold, ...], steps: int, grid: Grid) -> GaitProblem:
    """Return the problem of a walk along footholds, the right foot's first, with least energy per metre."""
    if steps != len(footholds):
        raise InputError(f"steps must be the number of footholds, {len(footholds)}, got {steps}")
    turning = any(foothold.yaw for foothold in footholds)
    loads = make_divided_loads(body, "lever")
    body = replace(body, upright=frozenset()) if turning else body  # a swinging foot turns
    feet, (*first, last) = list_feet(footholds, body.feet_y), make_phase_variables(body)
    given = (replace(last, name=name, unit=name.rpartition("_")[2], description="of the right foot") for name in RIGHT)
    planners = [make_footstep_planner(body, turning, swings) for swings in (False, True)]
    least = compute_sole_margins(body.robot.feet["left"], (LEAST_SHARE, LEAST_SHARE))
    margins = {
        Support.SINGLE: limit_to_sole(body, (0.0, body.feet_y[0]), least),
        Support.DOUBLE: make_stance_margins(body, feet[0]),
    }
    phases = make_walk_phases(body, (*first[:-1], *given), planners, margins, grid, loads)
    variables = make_footstep_variables(body, steps)
    both_ways = tuple(
        replace(v, lower=min(v.lower, -v.upper)) if v.name.startswith(("hip_x", "hip_vx")) else v for v in variables
    )
    walk = FootstepWalk(
        body=body,
        steps=steps,
        feet=feet,
        variables=both_ways,
        phases=phases,
        sections=list_footstep_sections(body, feet),
        states=list_states(steps),
    )
    return make_walk_problem(walk, variables)
