"""Motion of a walking cycle: from lift-off over touch-down to the mirror image of lift-off.

The left foot stands at x = 0, below its hip joint. The right foot swings from a step behind it to a step ahead of it, and then
both stand. Every coordinate is a cubic in Hermite form between the states at the two switches, and the state at the end is the
mirror image of the one at the start. So hip, feet and what else is planned have continuous positions and velocities for any x.
"""

from collections.abc import Callable
from typing import NamedTuple

from casadi import DM, SX, fmax, vertcat, vertsplit

from nlp_gait.formulation import InstantPoint, Variable
from nlp_gait.gaits.biped.body import LIFT, Angles, Body, Support, read_duration
from nlp_gait.gaits.biped.bounds import make_lift_variable, make_time_variable
from nlp_gait.gaits.biped.limits import REACH_MARGIN
from nlp_gait.gaits.biped.samples import Instant, Planner
from nlp_gait.gaits.biped.support_phases import swing_foot
from nlp_gait.gaits.biped.switch import SWITCHES, SwitchState, make_state_variables, read_state
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, cubic, stack

STEP_SHARES = (0.1, 0.6)  # of a leg's length; generous, so that reach decides
STEP = "step_length_m"
LEAST_STEP = 1e-3  # [m]; a shorter step is evaluated as this one, so that the path of the swing foot stays defined


class PhaseMotion(NamedTuple):
    """A phase of a walk over the left foot, which stands at x = 0: from state to state while the right foot swings or stands."""

    start: SwitchState
    end: SwitchState
    duration: SX  # [s]
    foot: Motion  # ankle (3,) of the right foot [m]
    turns: Angles = {}  # of torso and right foot, if they turn


def make_cycle_variables(body: Body) -> tuple[Variable, ...]:
    """Return the variables of a cycle, most with the bounds of the phases; the step length is the last one."""
    states = [variable for switch in SWITCHES for variable in make_state_variables(body, switch, switch)]
    low, high = (round(share * body.leg_length_m, 3) for share in STEP_SHARES)
    step = Variable(name=STEP, unit="m", lower=low, upper=high, description="from foot to foot")
    return (
        *states,
        make_lift_variable(body),
        make_time_variable(body, Support.SINGLE),
        make_time_variable(body, Support.DOUBLE),
        step,
    )


def make_cycle_planners(body: Body) -> dict[Support, Planner]:
    """Return the plans of both phases, which are continuous at touch-down."""
    images = DM([c.image for c in body.coordinates])
    mirror = SX([1, -1, 1])

    def read(point: InstantPoint) -> tuple[SwitchState, SwitchState, SX]:
        """States at lift-off and touch-down, and the step length [m]."""
        lift_off, landed = (read_state(point, switch, body.coordinates) for switch in SWITCHES)
        return lift_off, landed, fmax(point[STEP], LEAST_STEP)

    def single(point: InstantPoint, phase: SX) -> PhaseMotion:
        lift_off, landed, step = read(point)
        duration = read_duration(point, Support.SINGLE)
        foot = swing_foot(-step, step, *body.ankle("R"), point[LIFT], duration, phase)
        return PhaseMotion(lift_off, landed, duration, foot)

    def double(point: InstantPoint, phase: SX) -> PhaseMotion:
        (hip, velocity, angles, rates), landed, step = read(point)
        place = mirror * hip + vertcat(step, 0, 0)  # the mirror image of lift-off, a step further
        end = SwitchState(place, mirror * velocity, images * angles, images * rates)
        return PhaseMotion(landed, end, read_duration(point, Support.DOUBLE), body.standing_ankle("R", step))

    return {Support.SINGLE: make_planner(body, single), Support.DOUBLE: make_planner(body, double)}


def make_planner(body: Body, read: Callable[[InstantPoint, SX], PhaseMotion]) -> Planner:
    """Return the plan of a phase over the left foot from a function of its point and its time, a share of the duration."""
    left = body.standing_ankle("L")

    def plan(point: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        motion = read(point, phase)
        hip, angles = interpolate_states(motion.start, motion.end, motion.duration, phase)
        turned = {**body.cycle_angles(angles), **motion.turns}
        return body.plan(hip, turned, {"L": left, "R": motion.foot}, point[REACH_MARGIN], ops)

    return plan


def interpolate_states(
    start: SwitchState, end: SwitchState, duration: SX, phase: SX
) -> tuple[Motion, tuple[Motion, ...]]:
    """Motion of the hip (3,) [m] and of every coordinate [rad] from state to state."""

    def curves(*ends: SX) -> tuple[Motion, ...]:
        columns = zip(*map(vertsplit, ends), strict=True)
        return tuple(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in columns)

    hip = curves(start.hip, end.hip, start.hip_velocity, end.hip_velocity)
    return stack(*hip), curves(start.angles, end.angles, start.angle_rates, end.angle_rates)
