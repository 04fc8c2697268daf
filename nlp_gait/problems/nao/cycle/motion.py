"""Motion of NAO's walking cycle: from lift-off over touch-down to the mirror image of lift-off.

The left foot stands at x = 0, below its hip joint. The right foot swings from a step behind it to a step ahead of it, and then
both stand. Every coordinate is a cubic in Hermite form between the states at the two switches, and the state at the end is the
mirror image of the one at the start. So hip, feet, arms and leg joints have continuous positions and velocities for any x.
"""

from __future__ import annotations

from typing import NamedTuple

from casadi import SX, fmax, vertcat, vertsplit

from nlp_gait.problem import InstantPoint, Variable
from nlp_gait.problems.biped.parts import REACH_MARGIN
from nlp_gait.problems.biped.phase import PlannedInstant, Planner
from nlp_gait.problems.biped.samples import LEAST_DURATION
from nlp_gait.problems.nao.body import HELD_ARM_ANGLES, upright_plan
from nlp_gait.problems.nao.legs import hip_variables, leg_geometry
from nlp_gait.problems.nao.single_support import LIFT, swing_foot
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant, cubic, stack

SWITCHES = ("lift_off", "touch_down")
# Table 3 swings the shoulders about 1.5 rad and the elbows about 0.53 rad, their rolls by 0.22 rad for each rad of the shoulders.
MIDDLE_SHOULDER, MIDDLE_ELBOW, ELBOW_PER_SHOULDER = 1.5, 0.53, 0.22
LARGEST_SWING, LARGEST_RATE = 0.5, 1.0  # [rad], [rad/s]; Table 3 swings the shoulders by 0.5 rad to either side

# Ranges of the hip's place ahead of the left foot as shares of a leg's length, and of the step: generous, so that reach and
# balance decide. NAO's legs are 0.2029 m long.
HIP_X_SHARES = {"lift_off": (-0.25, 0.25), "touch_down": (-0.1, 0.5)}
STEP_SHARES = (0.1, 0.6)

STEP = "step_length_m"
LEAST_STEP = 1e-3  # [m]; a shorter step is evaluated as this one, so that the path of the swing foot stays defined
TIMES = {"ssp": "single_support_time_s", "dsp": "double_support_time_s"}


class State(NamedTuple):
    """Hip (3,) and arms at a switch: position with velocity [m, m/s], swing of the arms with its rate [rad, rad/s]."""

    hip: SX
    hip_velocity: SX
    arms: SX
    arms_rate: SX


class Cycle(NamedTuple):
    """What the decision variables say.

    Attributes:
        lift_off: state where the right foot leaves the ground.
        touch_down: state where it lands.
        lift: height of its swing [m].
        single: time of single support [s].
        double: time of double support [s].
        step: length from foot to foot [m].
    """

    lift_off: State
    touch_down: State
    lift: SX
    single: SX
    double: SX
    step: SX

    @property
    def end(self) -> State:
        """Mirror image of lift-off, a step further: there the left foot leaves the ground."""
        hip, velocity, arms, rate = self.lift_off
        mirror = SX([1, -1, 1])
        return State(mirror * hip + vertcat(self.step, 0, 0), mirror * velocity, -arms, -rate)


def cycle_variables(robot: Robot) -> tuple[Variable, ...]:
    """Variables of a cycle; the step length is the last one.

    Heights, velocities, swing height and times have the bounds of the published phases.
    """
    height, vz, _, vx, _, vy, _ = hip_variables(robot)
    leg = leg_geometry(robot, "L")
    length, half_width = leg.thigh_m + leg.tibia_m, leg.hip_m[1]
    found = []
    for switch in SWITCHES:
        at = f"at {switch.replace('_', '-')}"
        low, high = (round(share * length, 3) for share in HIP_X_SHARES[switch])
        rows = (
            ("hip_x", "m", low, high, "torso origin ahead of the left foot"),
            ("hip_y", "m", 0.0, half_width, "towards the left foot"),
            ("hip_z", "m", height.lower, height.upper, "height of the torso origin"),
            ("hip_vx", "m/s", vx.lower, vx.upper, "sagittal velocity"),
            ("hip_vy", "m/s", vy.lower, vy.upper, "lateral velocity"),
            ("hip_vz", "m/s", vz.lower, vz.upper, "vertical velocity"),
            (
                "arm_swing",
                "rad",
                -LARGEST_SWING,
                LARGEST_SWING,
                "left shoulder pitch beyond the middle, right one short of it",
            ),
            ("arm_rate", "rad/s", -LARGEST_RATE, LARGEST_RATE, "rate of the arms' swing"),
        )
        for name, unit, lower, upper, what in rows:
            suffix = {"m": "m", "m/s": "m_s", "rad": "rad", "rad/s": "rad_s"}[unit]
            found.append(
                Variable(
                    name=f"{name}_{switch}_{suffix}", unit=unit, lower=lower, upper=upper, description=f"{what}, {at}"
                )
            )
    low, high = (round(share * length, 3) for share in STEP_SHARES)
    return (
        *found,
        Variable(name=LIFT, unit="m", lower=0.015, upper=0.03, description="highest point of the swing foot"),
        Variable(name=TIMES["ssp"], unit="s", lower=0.4, upper=4.0, description="from lift-off to touch-down"),
        Variable(name=TIMES["dsp"], unit="s", lower=0.2, upper=2.0, description="from touch-down to the next lift-off"),
        Variable(name=STEP, unit="m", lower=low, upper=high, description="from foot to foot"),
    )


def cycle_from(at: InstantPoint) -> Cycle:
    """Cycle of the variables."""
    lift_off, touch_down = (
        State(
            vertcat(*(at[f"hip_{axis}_{switch}_m"] for axis in "xyz")),
            vertcat(*(at[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz")),
            at[f"arm_swing_{switch}_rad"],
            at[f"arm_rate_{switch}_rad_s"],
        )
        for switch in SWITCHES
    )
    single, double = (fmax(at[time], LEAST_DURATION) for time in TIMES.values())
    return Cycle(lift_off, touch_down, at[LIFT], single, double, fmax(at[STEP], LEAST_STEP))


def single_support_planner(robot: Robot) -> Planner:
    """From lift-off to touch-down over the left foot."""
    left, (right_y, right_z) = _standing(robot, "L"), _place(robot, "R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at)
        swing = swing_foot(-cycle.step, cycle.step, right_y, right_z, cycle.lift, cycle.single, phase)
        hip, arms = _between(cycle.lift_off, cycle.touch_down, cycle.single, phase)
        return upright_plan(robot, hip, {"L": left, "R": swing}, arms, at[REACH_MARGIN], ops)

    return plan


def double_support_planner(robot: Robot) -> Planner:
    """From touch-down to the mirror image of lift-off over both feet."""
    left, right = _standing(robot, "L"), _standing(robot, "R")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        cycle = cycle_from(at)
        ahead = right._replace(position=right.position + vertcat(cycle.step, 0, 0))
        hip, arms = _between(cycle.touch_down, cycle.end, cycle.double, phase)
        return upright_plan(robot, hip, {"L": left, "R": ahead}, arms, at[REACH_MARGIN], ops)

    return plan


def _between(start: State, end: State, duration: SX, phase: SX) -> tuple[Motion, dict[str, Motion]]:
    """Motion of the hip (3,) [m] and of the arms' joints [rad] from state to state."""
    ends = zip(*(vertsplit(part) for part in (start.hip, end.hip, start.hip_velocity, end.hip_velocity)), strict=True)
    hip = stack(*(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in ends))
    return hip, _arms(cubic(start.arms, end.arms, start.arms_rate, end.arms_rate, duration, phase))


def _arms(swing: Motion) -> dict[str, Motion]:
    """Joints of both arms, which swing against each other; elbows bend as their shoulders move."""

    def joint(middle: float, factor: float) -> Motion:
        return Motion(middle + factor * swing.position, factor * swing.velocity, factor * swing.acceleration)

    return {name: constant(angle) for name, angle in HELD_ARM_ANGLES.items()} | {
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
    return stack(*map(constant, (0.0, *_place(robot, side))))
