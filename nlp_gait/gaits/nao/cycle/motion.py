"""Motion of NAO's walking cycle: its variables, the swing of its arms, and the plans of both phases."""

from __future__ import annotations

from casadi import SX, vertcat

from nlp_gait.formulation import InstantPoint, Variable
from nlp_gait.gaits.biped.cycle_motion import LIFT, TIMES, Coordinate, between, cycle_from, cycle_variables
from nlp_gait.gaits.biped.instant import PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN
from nlp_gait.gaits.biped.single_support import swing_foot
from nlp_gait.gaits.nao.body import HELD_ARM_ANGLES, upright_plan
from nlp_gait.gaits.nao.legs import hip_variables, leg_geometry
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, stack

# Table 3 swings the shoulders about 1.5 rad and the elbows about 0.53 rad, their rolls by 0.22 rad for each rad of the shoulders.
MIDDLE_SHOULDER, MIDDLE_ELBOW, ELBOW_PER_SHOULDER = 1.5, 0.53, 0.22
LARGEST_SWING, LARGEST_RATE = 0.5, 1.0  # [rad], [rad/s]; Table 3 swings the shoulders by 0.5 rad to either side
SWINGS = (
    Coordinate(
        name="arm_swing",
        rate="arm_rate",
        bounds=(-LARGEST_SWING, LARGEST_SWING),
        largest_rate=LARGEST_RATE,
        image=-1.0,
        words="left shoulder pitch beyond the middle, right one short of it",
        rate_words="rate of the arms' swing",
    ),
)


def nao_cycle_variables(robot: Robot) -> tuple[Variable, ...]:
    """Variables of a cycle; heights, velocities, swing height and times have the bounds of the published phases."""
    leg = leg_geometry(robot, "L")
    own = (
        Variable(name=LIFT, unit="m", lower=0.015, upper=0.03, description="highest point of the swing foot"),
        Variable(name=TIMES["ssp"], unit="s", lower=0.4, upper=4.0, description="from lift-off to touch-down"),
        Variable(name=TIMES["dsp"], unit="s", lower=0.2, upper=2.0, description="from touch-down to the next lift-off"),
    )
    return cycle_variables(hip_variables(robot), leg.thigh_m + leg.tibia_m, leg.hip_m[1], SWINGS, own)


def single_support_planner(robot: Robot) -> Planner:
    """From lift-off to touch-down over the left foot."""
    left, (right_y, right_z) = _standing(robot, "L"), _place(robot, "R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at, SWINGS)
        swing = swing_foot(-cycle.step, cycle.step, right_y, right_z, cycle.lift, cycle.single, phase)
        hip, (arms,) = between(cycle.lift_off, cycle.touch_down, cycle.single, phase)
        return upright_plan(robot, hip, {"L": left, "R": swing}, _arms(arms), at[REACH_MARGIN], ops)

    return plan


def double_support_planner(robot: Robot) -> Planner:
    """From touch-down to the mirror image of lift-off over both feet."""
    left, right = _standing(robot, "L"), _standing(robot, "R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at, SWINGS)
        ahead = right._replace(position=right.position + vertcat(cycle.step, 0, 0))
        hip, (arms,) = between(cycle.touch_down, cycle.end, cycle.double, phase)
        return upright_plan(robot, hip, {"L": left, "R": ahead}, _arms(arms), at[REACH_MARGIN], ops)

    return plan


def _arms(swing: Motion) -> dict[str, Motion]:
    """Joints of both arms, which swing against each other; elbows bend as their shoulders move."""

    def joint(middle: float, factor: float) -> Motion:
        return Motion(middle + factor * swing.position, factor * swing.velocity, factor * swing.acceleration)

    return {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()} | {
        "LShoulderPitch": joint(MIDDLE_SHOULDER, 1.0),
        "RShoulderPitch": joint(MIDDLE_SHOULDER, -1.0),
        # Rolls turn against each other in mirrored motions, so that opposite swings have equal factors.
        "LElbowRoll": joint(-MIDDLE_ELBOW, ELBOW_PER_SHOULDER),
        "RElbowRoll": joint(MIDDLE_ELBOW, ELBOW_PER_SHOULDER),
    }


def _place(robot: Robot, side: str) -> tuple[float, float]:
    """Of an ankle below its own hip joint: across the walking direction, and its height [m]."""
    geometry = leg_geometry(robot, side)
    return geometry.hip_m[1], geometry.ankle_height_m


def _standing(robot: Robot, side: str) -> Motion:
    """An ankle (3,) at rest at x = 0 [m]."""
    return stack(*map(constant_motion, (0.0, *_place(robot, side))))
