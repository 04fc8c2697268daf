"""Walking cycle of any humanoid: both phases that fit together, at least energy per metre or least power at a speed."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import Array, GaitProblem, InstantPoint, Point, Variable, maker
from nlp_gait.gaits.biped.curves import grid_for
from nlp_gait.gaits.biped.cycle import SPEED, CycleGoal, WalkingCycle, cycle_problem, start_at_speed
from nlp_gait.gaits.biped.cycle_motion import (
    LIFT,
    STEP,
    TIMES,
    Coordinate,
    between,
    cycle_from,
    cycle_variables,
)
from nlp_gait.gaits.biped.double_support import (
    LOAD_DEGREE,
    Box,
    Sharing,
    double_support_mean_margins,
    margins_in,
    support_box,
)
from nlp_gait.gaits.biped.instant import PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN, Margins
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import goal_of
from nlp_gait.gaits.biped.single_support import loads_on_left, single_support_mean_margins, swing_foot
from nlp_gait.gaits.humanoid.body import GRAVITY, LARGEST_PITCH, LARGEST_ROLL, Humanoid, humanoid
from nlp_gait.gaits.humanoid.double_support import Share, standing
from nlp_gait.gaits.humanoid.problem import humanoid_motors, parts_of, with_body, within_reach
from nlp_gait.gaits.humanoid.single_support import sole_margins
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, stack

LARGEST_LEAN_RATE = 1.0  # of NAO's size [rad/s]
SPEED_M_S = 0.03  # NAO's


@maker
def humanoid_cycle(
    *,
    robot: str = "nao-v5",
    objective: CycleGoal = "energy-per-metre",
    intervals: int = 10,
    torso_share: Share = "lever",
    samples_per_interval: int = 0,
    drive_limits: bool = True,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Walking cycle: one step, whose mirror image is the next one; for the options see ``gaits.humanoid``.

    ``objective=power``, and ``torque`` for the mean of the sum of squared torques, are those at the speed ``speed_m_s``, a
    parameter: the step length follows from it.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; general legs, the free lean of the torso and the
        cycle are this package's own.
    """
    body = humanoid(robot)
    grid = grid_for("cubic", intervals, samples_per_interval, planned_loads=torso_share == "free")
    real, at_given_speed = humanoid_motors(motors, body), objective != "energy-per-metre"
    sharing = standing(body, real.model).sharing(torso_share, load_degree)
    *motion, step = humanoid_cycle_variables(body)
    variables = (*motion, *sharing.variables, step)
    margins = cycle_margins(body)
    goal = goal_of("torque" if objective == "torque" else "power", real, body.heat)
    halves = {
        "ssp": (single_support_planner(body), loads_on_left(real.model, GRAVITY, body.upright_feet), ()),
        "dsp": (sharing.planned(double_support_planner(body)), sharing.loads, sharing.parts),
    }
    phases = {
        name: Phase(
            robot=real.model,
            joints=body.biped.joints,
            planned=body.biped.joints,
            variables=variables,
            duration=TIMES[name],
            plan=plan,
            loads=loads,
            grid=grid,
            parts=(*parts_of(body, *margins[name], drive_limits=drive_limits), *real.parts, *more),
            goal=goal,
        )
        for name, (plan, loads, more) in halves.items()
    }
    cycle = humanoid_cycle_of(body, real.model, variables, phases, at_given_speed=at_given_speed)
    return _problem(body, cycle, sharing, at_given_speed)


def humanoid_cycle_of(
    body: Humanoid,
    model: Robot,
    variables: tuple[Variable, ...],
    phases: Mapping[str, Phase],
    *,
    at_given_speed: bool,
) -> WalkingCycle:
    """A humanoid's cycle from both phases; ``model``: its body, perhaps with the inertia of its rotors."""
    return WalkingCycle(
        robot=model,
        images=body.images,
        gravity=GRAVITY,
        torque_size=body.biped.torque_scale,
        speed_m_s=body.velocity(SPEED_M_S),
        variables=variables,
        phases=phases,
        at_given_speed=at_given_speed,
    )


def _problem(body: Humanoid, cycle: WalkingCycle, sharing: Sharing, at_given_speed: bool) -> GaitProblem:
    names = tuple(variable.name for variable in cycle.decisions)

    def reach(at: Point) -> MX:
        return ca.horzcat(*(phase.samples(cycle.motion(at), Exact()).reach for phase in cycle.phases.values()))

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        return start_at_speed(names, parameters, rng)

    own = sharing.start_of(names, start if at_given_speed else None)
    known = (REACH_MARGIN, *((SPEED,) if at_given_speed else ()))
    problem = cycle_problem("humanoid-cycle", body.biped.full.name, cycle, within_reach(names, known, reach, own))
    return with_body(problem, body, cycle.robot.armatures_kgm2, repeats=True)


def _coordinates(body: Humanoid) -> tuple[Coordinate, ...]:
    """Lean of the torso; a mirrored motion rolls the other way."""
    rate = float(f"{LARGEST_LEAN_RATE / body.biped.time_scale:.4g}")
    return tuple(
        Coordinate(
            name=name,
            rate=f"{name}_rate",
            bounds=(-largest, largest),
            largest_rate=rate,
            image=image,
            words=name.replace("_", " "),
            rate_words=f"rate of the {name.replace('_', ' ')}",
        )
        for name, largest, image in (("torso_roll", LARGEST_ROLL, -1.0), ("torso_pitch", LARGEST_PITCH, 1.0))
    )


def humanoid_cycle_variables(body: Humanoid) -> tuple[Variable, ...]:
    """Variables of a cycle; the step length is the last one."""
    leg_m, point = body.biped.leg_length_m, "middle of both hips"
    rows = (
        (LIFT, "m", body.length(0.015), body.length(0.03), "highest point of the swing foot"),
        (TIMES["ssp"], "s", body.time(0.4), body.time(4.0), "from lift-off to touch-down"),
        (TIMES["dsp"], "s", body.time(0.2), body.time(2.0), "from touch-down to the next lift-off"),
    )
    own = tuple(Variable(name=n, unit=u, lower=low, upper=high, description=text) for n, u, low, high, text in rows)
    return cycle_variables(body.hip_variables, leg_m, body.foot_y("left"), _coordinates(body), own, point)


def _standing_foot(body: Humanoid, side: str) -> Motion:
    """Origin of a standing foot's link (3,) at x = 0 [m]."""
    return stack(*map(constant_motion, (0.0, body.foot_y(side), body.ankle_height(side))))


def single_support_planner(body: Humanoid) -> Planner:
    """From lift-off to touch-down over the left foot."""
    coordinates, left = _coordinates(body), _standing_foot(body, "left")
    right_y, right_z = body.foot_y("right"), body.ankle_height("right")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at, coordinates)
        swing = swing_foot(-cycle.step, cycle.step, right_y, right_z, cycle.lift, cycle.single, phase)
        hip, (roll, pitch) = between(cycle.lift_off, cycle.touch_down, cycle.single, phase)
        return body.plan(hip, (roll, pitch), {"L": left, "R": swing}, at[REACH_MARGIN], ops)

    return plan


def double_support_planner(body: Humanoid) -> Planner:
    """From touch-down to the mirror image of lift-off over both feet."""
    coordinates = _coordinates(body)
    left, right = _standing_foot(body, "left"), _standing_foot(body, "right")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at, coordinates)
        ahead = right._replace(position=right.position + ca.vertcat(cycle.step, 0, 0))
        hip, (roll, pitch) = between(cycle.touch_down, cycle.end, cycle.double, phase)
        return body.plan(hip, (roll, pitch), {"L": left, "R": ahead}, at[REACH_MARGIN], ops)

    return plan


def cycle_margins(body: Humanoid) -> dict[str, tuple[Margins, tuple[float, float]]]:
    """Balance margins of each phase, and the default of the least mean ones in x and y [m]."""
    model = body.biped.model
    box = support_box(model, {"L": (0.0, body.foot_y("left")), "R": (body.step_length(0.0), body.foot_y("right"))})
    on_left = sole_margins((0.0, body.foot_y("left")), model.feet["left"])
    return {
        "ssp": (on_left, single_support_mean_margins(model.feet["left"])),
        "dsp": (_double_margins(body), double_support_mean_margins(box)),
    }


def _double_margins(body: Humanoid) -> Margins:
    """In the box around the left foot and the right one a step ahead."""
    feet = body.biped.model.feet
    fixed = support_box(body.biped.model, {"L": (0.0, body.foot_y("left")), "R": (0.0, body.foot_y("right"))})

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        step = at[STEP]
        back = ca.fmin(-feet["left"].back_m, step - feet["right"].back_m)
        front = ca.fmax(feet["left"].front_m, step + feet["right"].front_m)
        return margins_in(Box(back=back, front=front, right=fixed.right, left=fixed.left), zmp, ops)

    return margins
