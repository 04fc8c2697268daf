"""A walk from standing to standing along given footholds: each step has its own states, so that it can turn and change.

Each step is seen from its standing foot, mirrored if that is the right one: a left foot at x = 0 that points forward, and a right
foot that swings from foothold to foothold. The torso's yaw is the mean of both feet's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, InstantPoint, NumericPoint, Parameter, Point, Signals
from nlp_gait.formulation.assembly import Variable, make_parameters
from nlp_gait.gaits.biped.body import LIFT, RIGHT_YAW, TIMES, TORSO_YAW, Body
from nlp_gait.gaits.biped.cycle_motion import interpolate_states, make_cycle_variables, make_state_variables, read_state
from nlp_gait.gaits.biped.footholds import Foothold, find_support_sides, list_feet, list_swings
from nlp_gait.gaits.biped.joined_phases import STAND, join_phases
from nlp_gait.gaits.biped.limits import REACH_MARGIN, BalanceMargins, Margins, RowsAndIndexes
from nlp_gait.gaits.biped.load_sharing import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Instant, Planner
from nlp_gait.gaits.biped.support_phases import compute_sole_margins, limit_to_sole
from nlp_gait.gaits.biped.walk import NO_LIMIT, WholeWalk, make_speed_row, make_walk_phases, make_walk_problem
from nlp_gait.gaits.biped.walk_parts import DURATION, STAND_AT_END, Part, make_phase_variables, make_pose_variables
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, parabola_lift, stack

SHIFT = "shift_time_s"
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

    @cached_property
    def parts(self) -> dict[str, Part]:
        """All phases in the order of time, between the poses in which the robot stands; of these only the limits count."""
        swings = list_swings(self.feet[2:], self.body.feet_y)
        first = (swings[0][0],) * 2
        found = {
            STAND: Part(STAND, STAND, STAND, first, SHIFT, 1),
            "shift": Part(STAND, STAND, "step1_lift_off", first, SHIFT, 1),
        }
        for k, (lifted, landed) in enumerate(swings, 1):
            begin, middle = f"step{k}_lift_off", f"step{k}_touch_down"
            end = f"step{k + 1}_lift_off" if k < self.steps else STAND
            single, double = (f"step{k}_{time}" for time in TIMES.values())
            kind = STAND if np.allclose(landed, first[0], atol=BESIDE) else "dsp"
            found[f"step{k}_ssp"] = Part("ssp", begin, middle, (lifted, landed), single, k)
            found[f"step{k}_dsp"] = last = Part(kind, middle, end, (landed, landed), double, k)
        return {**found, STAND_AT_END: last._replace(begin=STAND)}

    @property
    def advances(self) -> list[float]:
        """Half the way of each step's foot [m]."""
        return [math.dist(a[:2], b[:2]) / 2 for a, b in zip(self.feet, self.feet[2:], strict=False)]

    def find_distance(self, at: Point, inner: MX) -> MX:
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

    def limit_speed(self, at: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndIndexes:
        """Return the rows of the inner steps: what both feet advance on average in a swing and the double support after it."""
        rows = []
        for k in range(2, self.steps):
            speed = self.advances[k - 1] / (times[f"step{k}_ssp"] + times[f"step{k}_dsp"])
            least, greatest = (at[name_speed(end, k)] for end in ("least", "greatest"))
            rows.append(make_speed_row(f"step{k}_speed", speed, least, greatest))
        return rows, {}

    def limit_phase(self, name: str) -> Phase:
        """Return the phase with the limits of a part: in double support, the ZMP is limited by the hull of both soles."""
        part = self.parts[name]
        if part.kind != "dsp":
            return self.phases[part.kind]
        return replace_margins(self.phases["dsp"], make_stance_margins(self.body, part.feet[1]))

    def _place_right_foot(self, part: Part, at: NumericPoint) -> list[MX | float]:
        return [*part.feet[0], *part.feet[1]]  # ``RIGHT``

    def _read_state(self, state: str, part: Part, at: NumericPoint) -> list[MX | float]:
        """Values of a state in the order of ``make_state_variables``, seen from the standing foot of a part."""
        coordinates, right, y = self.body.coordinates, part.feet[1], self.body.feet_y[0]
        if state == STAND:  # between both feet, in the mean of their directions
            _, _, height, *still = super()._read_state(STAND, part, at)
            ahead, half = at[f"hip_x_{STAND}_m"], right.yaw / 2
            return [right.x / 2 + math.cos(half) * ahead, (right.y + y) / 2 + math.sin(half) * ahead, height, *still]
        names = [variable.name for variable in make_state_variables(self.body, state, "lift_off")]
        values = [at[name] for name in names]
        if state.startswith(f"step{part.step}_"):
            return values
        hip_x, hip_y, z, vx, vy, vz, *angles = values  # the mirror image, seen from the foot that has landed
        images = [c.image for c in coordinates for _ in range(2)]
        (place_x, place_y), velocity = right.turn(hip_x, y - hip_y), right.turn(vx, -vy)
        mirrored = (i * a for i, a in zip(images, angles, strict=True))
        return [right.x + place_x, right.y + place_y, z, *velocity, vz, *mirrored]

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""
        steps, places = [], []
        for k, stance in enumerate(self.feet[1:-1], 1):
            own = [name for name, part in self.parts.items() if part.step == k and not name.startswith(STAND)]
            steps.append(join_phases(self.phases[self.parts[n].kind].signals(self.read_part(n, at)) for n in own))
            x, y = stance.turn(0.0, -self.body.feet_y[(k + 1) % 2])
            places.append((stance.x + x, stance.y + y, 0.0, stance.yaw))
        return join_steps(steps, self.body.robot, np.array(places))


def name_speed(end: str, step: int) -> str:
    """Return the name of the parameter that limits the speed of a step; ``end`` is least or greatest."""
    return f"step{step}_{end}_speed_m_s"


def replace_margins(phase: Phase, margins: BalanceMargins) -> Phase:
    """Return a phase with other balance margins."""
    limits = (margins if isinstance(limit, BalanceMargins) else limit for limit in phase.limits)
    return replace(phase, limits=tuple(limits))


def make_stance_margins(body: Body, right: Foothold) -> BalanceMargins:
    """Return the limit of the ZMP to the hull of both soles; the mean margins are those of a single sole."""
    left, soles = Foothold(0.0, body.feet_y[0], 0.0), body.robot.feet
    sides = find_support_sides([left.outline(soles["left"]), right.outline(soles["right"])])
    return BalanceMargins(make_polygon_margins(sides), compute_sole_margins(soles["left"]))


def make_polygon_margins(sides: Array) -> Margins:
    """Return the balance margins in x and y: distances along the axes to the sides (n, 3) of a convex polygon."""

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        def measure(axis: int) -> MX:
            slanted = [side for side in sides.tolist() if abs(side[axis]) > LEAST_SLANT]
            return ops.min(*(((d - x * zmp[0, :] - y * zmp[1, :]) / abs((x, y)[axis])).T for x, y, d in slanted)).T

        return measure(0), measure(1)

    return margins


def make_footstep_planner(body: Body, turning: bool, swings: bool) -> Planner:
    """Return the plan of a phase over the left foot: the right one swings straight to its foothold, or stands on it."""
    left, (_, height) = body.standing_ankle("L"), body.ankle("R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        begin, end = (read_state(at, name, body.coordinates) for name in ("begin", "end"))
        hip, angles = interpolate_states(begin, end, at[DURATION], phase)
        share, rise = constant_motion(1.0), constant_motion(0.0)
        if swings:
            share = cubic(SX(0), SX(1), SX(0), SX(0), at[DURATION], phase)
            rise = parabola_lift(share, 0.0, 1.0, at[LIFT])
        ends = zip(RIGHT[:3], RIGHT[3:], strict=True)
        x, y, yaw = (
            Motion(at[a] + (at[b] - at[a]) * share[0], *((at[b] - at[a]) * s for s in share[1:])) for a, b in ends
        )
        foot = stack(x, y, rise._replace(position=rise.position + height))
        turns = {TORSO_YAW: Motion(*(part / 2 for part in yaw)), RIGHT_YAW: yaw} if turning else {}
        return body.plan(hip, {**body.cycle_angles(angles), **turns}, {"L": left, "R": foot}, at[REACH_MARGIN], ops)

    return plan


def make_footstep_variables(body: Body, steps: int) -> tuple[Variable, ...]:
    """Return the variables of a walk of so many steps: the pose at both ends, and states, swing and times of each step."""
    own: Mapping[str, Variable] = {variable.name: variable for variable in make_cycle_variables(body)}
    found = [
        *make_pose_variables(body),
        replace(own[TIMES["dsp"]], name=SHIFT, description="duration of the phase shift"),
    ]
    for k in range(1, steps + 1):
        for switch in ("lift_off", "touch_down"):
            found += make_state_variables(body, f"step{k}_{switch}", switch)
        others = (own[name] for name in (LIFT, *TIMES.values()))
        found += [replace(v, name=f"step{k}_{v.name}", description=f"{v.description}, step {k}") for v in others]
    return tuple(found)


def plan_footstep_walk(body: Body, footholds: tuple[Foothold, ...], steps: int, grid: Grid) -> GaitProblem:
    """Return the problem of a walk along footholds, the right foot's first, with least energy per metre."""
    if steps != len(footholds):
        raise InputError(f"steps must be the number of footholds, {len(footholds)}, got {steps}")
    turning = any(foothold.yaw for foothold in footholds)
    loads = make_divided_loads(body, "lever")
    body = replace(body, upright=frozenset()) if turning else body  # a swinging foot turns
    feet, (*others, last) = list_feet(footholds, body.feet_y), make_phase_variables(body)
    given = (replace(last, name=name, unit=name.rpartition("_")[2], description="of the right foot") for name in RIGHT)
    planners = [make_footstep_planner(body, turning, swings) for swings in (False, True)]
    phases = make_walk_phases(body, (*others[:-1], *given), planners, grid, loads)
    least = compute_sole_margins(body.robot.feet["left"], (LEAST_SHARE, LEAST_SHARE))
    phases["ssp"] = replace_margins(phases["ssp"], limit_to_sole(body, (0.0, body.feet_y[0]), least))
    phases["dsp"] = replace_margins(phases["dsp"], make_stance_margins(body, feet[0]))
    variables = make_footstep_variables(body, steps)
    both_ways = tuple(
        replace(v, lower=min(v.lower, -v.upper)) if v.name.startswith(("hip_x", "hip_vx")) else v for v in variables
    )
    walk = FootstepWalk(body=body, steps=steps, feet=feet, variables=both_ways, phases=phases)
    return make_walk_problem(walk, variables)
