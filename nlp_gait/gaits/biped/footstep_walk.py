"""A walk from standing to standing along given footholds: each step has its own states, so that it can turn and change.

Each step is seen from its standing foot, mirrored if that is the right one: a left foot at x = 0 that points forward, and a right
foot that swings from foothold to foothold. The torso's yaw is the mean of both feet's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import (
    Array,
    Assembly,
    Display,
    GaitProblem,
    Grid,
    InstantPoint,
    NumericPoint,
    Parameter,
    Point,
    Signals,
    SolverHints,
    Variable,
)
from nlp_gait.gaits.biped.body import LIFT, RIGHT_YAW, TIMES, TORSO_YAW, Body
from nlp_gait.gaits.biped.cycle_motion import between, make_cycle_variables, make_state_variables, read_state
from nlp_gait.gaits.biped.double_support import (
    compute_double_support_mean_margins,
    make_double_support_margins,
    make_support_box,
)
from nlp_gait.gaits.biped.footholds import Foothold, find_support_sides, list_feet, list_swings
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.joined_phases import (
    ENERGY_PER_METRE,
    STAND,
    assemble_part,
    collect_parameters,
    join_phases,
)
from nlp_gait.gaits.biped.limits import REACH_MARGIN, BalanceMargins, Margins
from nlp_gait.gaits.biped.load_sharing import LoadSharing
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import add_robot, make_phase_limits
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Instant, Planner, Samples
from nlp_gait.gaits.biped.single_support import compute_single_support_mean_margins, make_single_support_loads
from nlp_gait.gaits.biped.walk_parts import DURATION
from nlp_gait.gaits.biped.walk_start import start_walk
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, parabola_lift, stack

SHIFT = "shift_time_s"
# Variables of a phase besides those of its first and last state, its swing and its duration: the right foot's foothold at both
# ends, seen from the left foot.
RIGHT = tuple(f"right_{end}_{what}" for end in ("from", "to") for what in ("x_m", "y_m", "yaw_rad"))
BESIDE = 1e-6  # [m, rad]; feet this close to their places at the start stand side by side
FAR = 100.0  # bound of these, which are given
LEAST_SLANT = 1e-2  # component of a side's normal along an axis, below which there is no distance to the side along it


class FootstepPart(NamedTuple):
    """A phase over the left foot."""

    kind: str  # ``ssp``, ``dsp``, or ``stand`` with both feet side by side
    step: int  # from 1, whose standing foot is the left one here
    begin: str  # state
    end: str
    right: tuple[Foothold, Foothold]  # of the right foot at begin and end
    duration: str  # variable


@dataclass(frozen=True, kw_only=True, eq=False)
class FootstepWalk:
    """A walk along footholds, sampled over all its phases."""

    body: Body
    feet: tuple[Foothold, ...]  # right and left foot at the start, then where each step lands
    variables: tuple[Variable, ...]
    phases: Mapping[str, Phase]  # by kind; in double support with the margins of a stance side by side

    @property
    def steps(self) -> int:
        """Number of swings."""
        return len(self.feet) - 2

    @cached_property
    def parts(self) -> dict[str, FootstepPart]:
        """All phases in the order of time, between the poses in which the robot stands; of these only the limits count."""
        swings = list_swings(self.feet[2:], self.body.feet_y)
        first = (swings[0][0],) * 2
        found = {
            STAND: FootstepPart(STAND, 1, STAND, STAND, first, SHIFT),
            "shift": FootstepPart(STAND, 1, STAND, "step1_lift_off", first, SHIFT),
        }
        for k, (lifted, landed) in enumerate(swings, 1):
            begin, middle = f"step{k}_lift_off", f"step{k}_touch_down"
            end = f"step{k + 1}_lift_off" if k < self.steps else STAND
            times = {kind: f"step{k}_{time}" for kind, time in TIMES.items()}
            found[f"step{k}_ssp"] = FootstepPart("ssp", k, begin, middle, (lifted, landed), times["ssp"])
            kind = STAND if np.allclose(landed, first[0], atol=BESIDE) else "dsp"
            found[f"step{k}_dsp"] = FootstepPart(kind, k, middle, end, (landed, landed), times["dsp"])
        return {**found, "rest": found[f"step{self.steps}_dsp"]._replace(begin=STAND)}

    @property
    def moving(self) -> dict[str, FootstepPart]:
        """The phases without the poses."""
        return {name: part for name, part in self.parts.items() if name not in (STAND, "rest")}

    @property
    def distance_m(self) -> float:
        """Mean of the lengths of both feet's paths."""
        return sum(math.dist(a[:2], b[:2]) for a, b in zip(self.feet, self.feet[2:], strict=False)) / 2

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases; those of balance begin with the kind of the phase."""
        return tuple(sorted(collect_parameters(self.phases), key=lambda p: p.name.endswith((".lower", ".upper"))))

    def assemble(self, at: Point, ops: Nonsmooth) -> Assembly:
        """Return energy per metre, rows and indexes."""
        points = {name: self.read_part(part, at) for name, part in self.parts.items()}
        samples: dict[str, Samples] = {}
        for kinds in (("ssp",), ("dsp", STAND)):  # double support differs in its limits only
            names = [name for name, part in self.parts.items() if part.kind in kinds]
            several = self.phases[kinds[0]].sample_several([points[name] for name in names], ops)
            samples |= dict(zip(names, several, strict=True))
        found = {
            name: assemble_part(name, part.kind, self._limit_phase(part), points[name], samples[name], ops)
            for name, part in self.parts.items()
        }
        energy = sum((found[name].indexes[f"{name}_power_W"] * points[name][DURATION] for name in self.moving), MX(0))
        return Assembly(
            objective=energy / self.distance_m,
            constraints=tuple(row for part in found.values() for row in part.constraints),
            indexes={
                "energy_J": energy,
                "distance_m": MX(self.distance_m),
                "duration_s": sum((points[name][DURATION] for name in self.moving), MX(0)),
                "energy_J_per_m": energy / self.distance_m,
                **{name: value for part in found.values() for name, value in part.indexes.items()},
            },
        )

    def _limit_phase(self, part: FootstepPart) -> Phase:
        """Return the phase of a part: in double support, the ZMP is limited by the hull of both soles."""
        phase = self.phases[part.kind]
        return replace_margins(phase, make_stance_margins(self.body, part.right[1])) if part.kind == "dsp" else phase

    def read_part(self, part: FootstepPart, at: NumericPoint) -> NumericPoint:
        """Return the point of one phase: its own variables, see ``make_footstep_variables``, from those of the walk."""
        lift = at[f"step{part.step}_{LIFT}"] if part.kind == "ssp" else 0.0
        values = [value for state in (part.begin, part.end) for value in self._read_state(state, part, at)]
        values += [lift, ca.fmax(at[part.duration], LEAST_DURATION), *part.right[0], *part.right[1]]
        names = self.phases["ssp"].names
        own = {n: p for n, p in at.positions.items() if p[0] == "p"} | {n: ("x", i) for i, n in enumerate(names)}
        return replace(at, x=ca.vertcat(*values), positions=own)

    def _read_state(self, state: str, part: FootstepPart, at: NumericPoint) -> list[MX | float]:
        """Values of a state in the order of ``make_state_variables``, seen from the standing foot of a part."""
        coordinates, right, y = self.body.coordinates, part.right[1], self.body.feet_y[0]
        cos, sin = math.cos(right.yaw), math.sin(right.yaw)
        if state == STAND:  # between both feet, in the mean of their directions
            angles = [at[f"{c.name}_{STAND}_rad"] if c.image > 0 else 0 for c in coordinates]
            ahead, half = at[f"hip_x_{STAND}_m"], right.yaw / 2
            place = right.x / 2 + math.cos(half) * ahead, (right.y + y) / 2 + math.sin(half) * ahead
            return [*place, at[f"hip_z_{STAND}_m"], 0, 0, 0, *(v for angle in angles for v in (angle, 0))]
        names = [variable.name for variable in make_state_variables(self.body, state, "lift_off")]
        values = [at[name] for name in names]
        if state.startswith(f"step{part.step}_"):
            return values
        hip_x, hip_y, z, vx, vy, vz, *angles = values  # the mirror image, seen from the foot that has landed
        images = [c.image for c in coordinates for _ in range(2)]
        (ahead, aside), (forward, leftward) = (hip_x, y - hip_y), (vx, -vy)
        place = right.x + cos * ahead - sin * aside, right.y + sin * ahead + cos * aside
        rate = cos * forward - sin * leftward, sin * forward + cos * leftward
        return [*place, z, *rate, vz, *(image * angle for image, angle in zip(images, angles, strict=True))]

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""
        steps, places = [], []
        for k in range(1, self.steps + 1):
            own = [part for part in self.moving.values() if part.step == k]
            steps.append(join_phases(self.phases[part.kind].signals(self.read_part(part, at)) for part in own))
            x, y, yaw = self.feet[k]
            aside = self.body.feet_y[(k + 1) % 2]
            places.append((x + math.sin(yaw) * aside, y - math.cos(yaw) * aside, 0.0, yaw))
        return join_steps(steps, self.body.robot, np.array(places))


def replace_margins(phase: Phase, margins: BalanceMargins) -> Phase:
    """Return a phase with other balance margins."""
    limits = (margins if isinstance(limit, BalanceMargins) else limit for limit in phase.limits)
    return replace(phase, limits=tuple(limits))


def make_stance_margins(body: Body, right: Foothold) -> BalanceMargins:
    """Return the limit of the ZMP to the hull of both soles; the mean margins are those of a single sole."""
    left, soles = Foothold(0.0, body.feet_y[0], 0.0), body.robot.feet
    sides = find_support_sides([left.outline(soles["left"]), right.outline(soles["right"])])
    return BalanceMargins(make_polygon_margins(sides), compute_single_support_mean_margins(soles["left"]))


def make_polygon_margins(sides: Array) -> Margins:
    """Return the balance margins in x and y: distances along the axes to the sides (n, 3) of a convex polygon."""

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        def measure(axis: int) -> MX:
            slanted = [side for side in sides.tolist() if abs(side[axis]) > LEAST_SLANT]
            return ops.min(*(((d - x * zmp[0, :] - y * zmp[1, :]) / abs((x, y)[axis])).T for x, y, d in slanted)).T

        return measure(0), measure(1)

    return margins


def make_footstep_planner(body: Body, swings: bool) -> Planner:
    """Return the plan of a phase over the left foot: the right one swings straight to its foothold, or stands on it."""
    left, (_, height) = body.standing_ankle("L"), body.ankle("R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        begin, end = (read_state(at, name, body.coordinates) for name in ("begin", "end"))
        hip, angles = between(begin, end, at[DURATION], phase)
        starts, ends = [at[name] for name in RIGHT[:3]], [at[name] for name in RIGHT[3:]]
        if swings:
            share = cubic(SX(0), SX(1), SX(0), SX(0), at[DURATION], phase)
            rise = parabola_lift(share, 0.0, 1.0, at[LIFT])
            x, y, yaw = (
                Motion(a + (b - a) * share.position, (b - a) * share.velocity, (b - a) * share.acceleration)
                for a, b in zip(starts, ends, strict=True)
            )
            foot = stack(x, y, rise._replace(position=rise.position + height))
        else:
            x, y, yaw = (Motion(place, SX(0), SX(0)) for place in ends)
            foot = stack(x, y, constant_motion(height))
        turns = {TORSO_YAW: Motion(*(part / 2 for part in yaw)), RIGHT_YAW: yaw}
        return body.plan(hip, {**body.cycle_angles(angles), **turns}, {"L": left, "R": foot}, at[REACH_MARGIN], ops)

    return plan


def make_footstep_variables(body: Body) -> tuple[Variable, ...]:
    """Return the variables of one phase: states at both ends, height of the swing, duration, footholds of the right foot."""
    states = [
        *make_state_variables(body, "begin", "lift_off"),
        *make_state_variables(body, "end", "touch_down"),
    ]
    footholds = (
        Variable(name=name, unit=name.rpartition("_")[2], lower=-FAR, upper=FAR, description="of the right foot")
        for name in RIGHT
    )
    return (*states, body.lift_variable, replace(body.make_time_variable("ssp"), name=DURATION), *footholds)


def make_walk_variables(body: Body, steps: int) -> tuple[Variable, ...]:
    """Return the variables of a walk of so many steps: the pose at both ends, and states, swing and times of each step."""
    own = {variable.name: variable for variable in make_cycle_variables(body)}
    pose = ["hip_x_{}_m", "hip_z_{}_m", *(f"{c.name}_{{}}_rad" for c in body.coordinates if c.image > 0)]
    found = [replace(own[name.format("lift_off")], name=name.format(STAND)) for name in pose]
    found = [replace(v, description=v.description.replace("at lift-off", "standing")) for v in found]
    found.append(replace(body.make_time_variable("dsp"), name=SHIFT, description="duration of the first weight shift"))
    for k in range(1, steps + 1):
        for switch in ("lift_off", "touch_down"):
            found += make_state_variables(body, f"step{k}_{switch}", switch)
        others = (own[name] for name in (LIFT, *TIMES.values()))
        found += [replace(v, name=f"step{k}_{v.name}", description=f"{v.description}, step {k}") for v in others]
    return tuple(found)


def plan_footstep_walk(
    body: Body, footholds: tuple[Foothold, ...], grid: Grid, goal: Goal, sharing: LoadSharing
) -> GaitProblem:
    """Return the problem of a walk along footholds, the right foot's first, with least energy per metre."""
    body = replace(body, upright=frozenset())  # a swinging foot turns
    feet, foot = list_feet(footholds, body.feet_y), body.robot.feet["left"]
    right, left, *_ = feet
    box = make_support_box(body.robot, {"L": left[:2], "R": right[:2]})
    margins = {
        "ssp": (body.make_sole_margins(left[:2]), compute_single_support_mean_margins(foot)),
        STAND: (make_double_support_margins(box), compute_double_support_mean_margins(box)),
    }
    phases = {
        kind: Phase(
            body=body,
            variables=make_footstep_variables(body),
            duration=DURATION,
            plan=make_footstep_planner(body, swings=kind == "ssp"),
            loads=make_single_support_loads(body) if kind == "ssp" else sharing.loads,
            grid=grid,
            limits=(*make_phase_limits(body, *own), *body.motors.limits),
            goal=goal,
        )
        for kind, own in margins.items()
    }
    phases["dsp"] = replace_margins(phases[STAND], make_stance_margins(body, right))
    variables = make_walk_variables(body, len(footholds))
    wide = tuple(
        replace(v, lower=min(v.lower, -v.upper)) if v.name.startswith(("hip_x", "hip_vx")) else v for v in variables
    )
    walk = FootstepWalk(body=body, feet=feet, variables=wide, phases=phases)
    problem = GaitProblem(
        name=f"{body.family}-walk",
        title=f"{body.title}, walk along footholds: least energy per metre",
        variables=wide,
        own_parameters=walk.parameters,
        objective=ENERGY_PER_METRE,
        assemble=walk.assemble,
        grid=grid,
        display=Display(motion=walk.signals, durations=tuple(part.duration for part in walk.moving.values())),
        hints=SolverHints(start=partial(start_walk, variables, 0.0), starts=3, searchable=False),
    )
    return add_robot(problem, body, steps=walk.steps)
