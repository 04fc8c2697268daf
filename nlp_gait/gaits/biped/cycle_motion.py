"""Motion of a walking cycle: from lift-off over touch-down to the mirror image of lift-off.

The left foot stands at x = 0, below its hip joint. The right foot swings from a step behind it to a step ahead of it, and then
both stand. Every coordinate is a cubic in Hermite form between the states at the two switches, and the state at the end is the
mirror image of the one at the start. So hip, feet and what else is planned have continuous positions and velocities for any x.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from casadi import DM, SX, fmax, vertcat, vertsplit

from nlp_gait.formulation import InstantPoint, Variable
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.body import LIFT, Body, Coordinate, Support, read_duration
from nlp_gait.gaits.biped.bounds import make_hip_variables, make_lift_variable, make_time_variable
from nlp_gait.gaits.biped.flight import Flight
from nlp_gait.gaits.biped.limits import REACH_MARGIN
from nlp_gait.gaits.biped.samples import Instant, Planner
from nlp_gait.gaits.biped.support_phases import swing_foot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, cubic, stack

SWITCHES = ("lift_off", "touch_down")
# Ranges of the hip's place ahead of the left foot as shares of a leg's length, and of the step: generous, so that reach and
# balance decide. NAO's legs are 0.2029 m long.
HIP_X_SHARES = {"lift_off": (-0.25, 0.25), "touch_down": (-0.1, 0.5)}
STEP_SHARES = (0.1, 0.6)

STEP = "step_length_m"
LANDING, LANDING_M_S = "foot_vx_touch_down_m_s", 0.5  # of an inelastic touch-down; the greatest, of NAO
AFTER = "after_touch_down"
LEAST_STEP = 1e-3  # [m]; a shorter step is evaluated as this one, so that the path of the swing foot stays defined
SUFFIXES = {"m": "m", "m/s": "m_s", "rad": "rad", "rad/s": "rad_s"}


class SwitchState(NamedTuple):
    """Hip (3,) and coordinates (k,) at a switch: position with velocity [m, m/s], angles with their rates [rad, rad/s]."""

    hip: SX
    hip_velocity: SX
    angles: SX
    angle_rates: SX


class PhaseMotion(NamedTuple):
    """A phase of a walk over the left foot: from state to state while the right foot swings, or stands if ``lift`` is None."""

    start: SwitchState
    end: SwitchState
    duration: SX  # [s]
    right_from: SX  # x of the right foot from the left one [m]
    right_to: SX  # at the end [m]
    lift: SX | None = None  # height of the swing [m]
    landing_m_s: SX | float = 0.0  # forward velocity of the swinging foot at its end


def make_cycle_variables(body: Body, inelastic: bool = False) -> tuple[Variable, ...]:
    """Return the variables of a cycle, most with the bounds of the phases; the step length is the last one."""
    states = [variable for switch in SWITCHES for variable in make_state_variables(body, switch, switch)]
    low, high = (round(share * body.leg_length_m, 3) for share in STEP_SHARES)
    step = Variable(name=STEP, unit="m", lower=low, upper=high, description="from foot to foot")
    if inelastic:
        fastest, words = body.scale_time(LANDING_M_S * body.swing_speed), "forward velocity of the landing foot"
        speed = Variable(name=LANDING, unit="m/s", lower=0.0, upper=fastest, description=words)
        states += [*make_landing_rates(body), speed]
    return (
        *states,
        make_lift_variable(body),
        make_time_variable(body, Support.SINGLE),
        make_time_variable(body, Support.DOUBLE),
        step,
    )


def make_landing_rates(body: Body) -> list[Variable]:
    """Return the variables of the velocities right after an inelastic touch-down, of the hip and of every coordinate."""
    return [v for v in make_state_variables(body, AFTER, "touch_down") if v.unit in ("m/s", "rad/s")]


def make_state_variables(body: Body, name: str, switch: str) -> list[Variable]:
    """Return the variables of the state at a switch of ``SWITCHES``, whose names contain ``name``."""
    height, vz, _, vx, _, vy, _ = make_hip_variables(body)
    when = f"at {name.replace('_', '-')}"
    low, high = (round(share * body.leg_length_m, 3) for share in HIP_X_SHARES[switch])
    table = [
        ("hip_x", "m", low, high, f"{body.hip_name} ahead of the left foot"),
        ("hip_y", "m", 0.0, body.feet_y[0], "towards the left foot"),
        ("hip_z", "m", height.lower, height.upper, f"height of the {body.hip_name}"),
        ("hip_vx", "m/s", vx.lower, vx.upper, "sagittal velocity"),
        ("hip_vy", "m/s", vy.lower, vy.upper, "lateral velocity"),
        ("hip_vz", "m/s", vz.lower, vz.upper, "vertical velocity"),
    ]
    for c in body.coordinates:
        table.append((c.name, "rad", *c.bounds, c.words))
        table.append((c.rate, "rad/s", -c.largest_rate, c.largest_rate, c.rate_words))
    rows = (
        (f"{what}_{name}_{SUFFIXES[unit]}", unit, lower, upper, f"{words}, {when}")
        for what, unit, lower, upper, words in table
    )
    return list(make_variables(*rows))


def make_cycle_planners(body: Body, inelastic: bool = False) -> dict[Support, Planner]:
    """Return the plans of both phases; after an inelastic touch-down all velocities are variables of their own."""
    images = DM([c.image for c in body.coordinates])
    mirror = SX([1, -1, 1])

    def read(point: InstantPoint) -> tuple[SwitchState, SwitchState, SX]:
        """States at lift-off and touch-down, and the step length [m]."""
        lift_off, touch_down = (read_state(point, switch, body.coordinates) for switch in SWITCHES)
        return lift_off, touch_down, fmax(point[STEP], LEAST_STEP)

    def single(point: InstantPoint) -> PhaseMotion:
        lift_off, touch_down, step = read(point)
        speed = point[LANDING] if inelastic else 0.0
        return PhaseMotion(lift_off, touch_down, read_duration(point, Support.SINGLE), -step, step, point[LIFT], speed)

    def double(point: InstantPoint) -> PhaseMotion:
        (hip, velocity, angles, rates), touch_down, step = read(point)
        place = mirror * hip + vertcat(step, 0, 0)  # the mirror image of lift-off, a step further
        if inelastic:
            velocity_after, rates_after = read_rates(point, AFTER, body.coordinates)
            touch_down = touch_down._replace(hip_velocity=velocity_after, angle_rates=rates_after)
        end = SwitchState(place, mirror * velocity, images * angles, images * rates)
        return PhaseMotion(touch_down, end, read_duration(point, Support.DOUBLE), step, step)

    return {Support.SINGLE: make_planner(body, single), Support.DOUBLE: make_planner(body, double)}


def make_planner(body: Body, read: Callable[[InstantPoint], PhaseMotion], flight: Flight | None = None) -> Planner:
    """Return the plan of a phase over the left foot, which stands at x = 0, on the flat or on a flight of stairs."""
    left, right = body.standing_ankle("L"), body.standing_ankle("R")
    right_y, right_z = body.ankle("R")

    def plan(point: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
        leg = read(point)
        if leg.lift is None:
            height = 0 if flight is None else flight.slope * leg.right_to
            foot = right._replace(position=right.position + vertcat(leg.right_to, 0, height))
        elif flight is not None:
            foot = flight.swing(leg.right_from, leg.right_to, right_y, right_z, leg.lift, leg.duration, phase)
        else:
            foot = swing_foot(
                leg.right_from, leg.right_to, right_y, right_z, leg.lift, leg.duration, phase, leg.landing_m_s
            )
        hip, angles = interpolate_states(leg.start, leg.end, leg.duration, phase)
        return body.plan(hip, body.cycle_angles(angles), {"L": left, "R": foot}, point[REACH_MARGIN], ops)

    return plan


def read_state(point: InstantPoint, name: str, coordinates: Sequence[Coordinate]) -> SwitchState:
    """State of the variables whose names contain ``name``."""
    velocity, rates = read_rates(point, name, coordinates)
    hip = vertcat(*(point[f"hip_{axis}_{name}_m"] for axis in "xyz"))
    return SwitchState(hip, velocity, vertcat(*(point[f"{c.name}_{name}_rad"] for c in coordinates)), rates)


def read_rates(point: InstantPoint, name: str, coordinates: Sequence[Coordinate]) -> tuple[SX, SX]:
    """Return velocity of the hip (3,) [m/s] and rates of all coordinates (k,) [rad/s] at the state of a name."""
    velocity = vertcat(*(point[f"hip_v{axis}_{name}_m_s"] for axis in "xyz"))
    return velocity, vertcat(*(point[f"{c.rate}_{name}_rad_s"] for c in coordinates))


def interpolate_states(
    start: SwitchState, end: SwitchState, duration: SX, phase: SX
) -> tuple[Motion, tuple[Motion, ...]]:
    """Motion of the hip (3,) [m] and of every coordinate [rad] from state to state."""

    def curves(*ends: SX) -> tuple[Motion, ...]:
        columns = zip(*map(vertsplit, ends), strict=True)
        return tuple(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in columns)

    hip = curves(start.hip, end.hip, start.hip_velocity, end.hip_velocity)
    return stack(*hip), curves(start.angles, end.angles, start.angle_rates, end.angle_rates)
