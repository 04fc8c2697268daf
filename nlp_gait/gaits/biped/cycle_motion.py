"""Motion of a walking cycle: from lift-off over touch-down to the mirror image of lift-off.

The left foot stands at x = 0, below its hip joint. The right foot swings from a step behind it to a step ahead of it, and then
both stand. Every coordinate is a cubic in Hermite form between the states at the two switches, and the state at the end is the
mirror image of the one at the start. So hip, feet and what else is planned have continuous positions and velocities for any x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from casadi import DM, SX, fmax, vertcat, vertsplit

from nlp_gait.formulation import InstantPoint, Variable
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.symbolic.trajectories import Motion, cubic, stack

SWITCHES = ("lift_off", "touch_down")
# Ranges of the hip's place ahead of the left foot as shares of a leg's length, and of the step: generous, so that reach and
# balance decide. NAO's legs are 0.2029 m long.
HIP_X_SHARES = {"lift_off": (-0.25, 0.25), "touch_down": (-0.1, 0.5)}
STEP_SHARES = (0.1, 0.6)

STEP, LIFT = "step_length_m", "swing_height_m"
LEAST_STEP = 1e-3  # [m]; a shorter step is evaluated as this one, so that the path of the swing foot stays defined
TIMES = {"ssp": "single_support_time_s", "dsp": "double_support_time_s"}
SUFFIXES = {"m": "m", "m/s": "m_s", "rad": "rad", "rad/s": "rad_s"}


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """An angle that is planned beside the hip.

    Attributes:
        name: of its variables.
        rate: name of its rate's variables.
        largest: of either sign, or a pair of bounds [rad].
        largest_rate: of either sign [rad/s].
        image: +1 or -1: what a mirrored motion has.
        words: what it is.
        rate_words: what its rate is.
    """

    name: str
    rate: str
    bounds: tuple[float, float]
    largest_rate: float
    image: float
    words: str
    rate_words: str


class State(NamedTuple):
    """Hip (3,) and coordinates (k,) at a switch: position with velocity [m, m/s], angles with their rates [rad, rad/s]."""

    hip: SX
    hip_velocity: SX
    others: SX
    others_rate: SX


class Cycle(NamedTuple):
    """What the decision variables say.

    Attributes:
        lift_off: state where the right foot leaves the ground.
        touch_down: state where it lands.
        lift: height of its swing [m].
        single: time of single support [s].
        double: time of double support [s].
        step: length from foot to foot [m].
        images: (k,) signs of the coordinates in a mirrored motion.
    """

    lift_off: State
    touch_down: State
    lift: SX
    single: SX
    double: SX
    step: SX
    images: DM

    @property
    def end(self) -> State:
        """Mirror image of lift-off, a step further: there the left foot leaves the ground."""
        hip, velocity, others, rates = self.lift_off
        mirror = SX([1, -1, 1])
        return State(
            mirror * hip + vertcat(self.step, 0, 0), mirror * velocity, self.images * others, self.images * rates
        )


def cycle_variables(
    hip: Sequence[Variable],
    leg_m: float,
    half_width_m: float,
    coordinates: Sequence[Coordinate],
    lift_and_times: Sequence[Variable],
    point: str = "torso origin",
) -> tuple[Variable, ...]:
    """Variables of a cycle; the step length is the last one.

    Args:
        hip: of a published phase: height, then velocities in z, x and y at both ends, whose bounds are taken.
        leg_m: length of a leg.
        half_width_m: from the middle to a foot.
        coordinates: planned beside the hip.
        lift_and_times: swing height and both times.
        point: what the hip is, in words.
    """
    height, vz, _, vx, _, vy, _ = hip
    found = []
    for switch in SWITCHES:
        at = f"at {switch.replace('_', '-')}"
        low, high = (round(share * leg_m, 3) for share in HIP_X_SHARES[switch])
        table = [
            ("hip_x", "m", low, high, f"{point} ahead of the left foot"),
            ("hip_y", "m", 0.0, half_width_m, "towards the left foot"),
            ("hip_z", "m", height.lower, height.upper, f"height of the {point}"),
            ("hip_vx", "m/s", vx.lower, vx.upper, "sagittal velocity"),
            ("hip_vy", "m/s", vy.lower, vy.upper, "lateral velocity"),
            ("hip_vz", "m/s", vz.lower, vz.upper, "vertical velocity"),
        ]
        for c in coordinates:
            table.append((c.name, "rad", *c.bounds, c.words))
            table.append((c.rate, "rad/s", -c.largest_rate, c.largest_rate, c.rate_words))
        found += [
            Variable(
                name=f"{name}_{switch}_{SUFFIXES[unit]}",
                unit=unit,
                lower=lower,
                upper=upper,
                description=f"{what}, {at}",
            )
            for name, unit, lower, upper, what in table
        ]
    low, high = (round(share * leg_m, 3) for share in STEP_SHARES)
    step = Variable(name=STEP, unit="m", lower=low, upper=high, description="from foot to foot")
    return (*found, *lift_and_times, step)


def cycle_from(at: InstantPoint, coordinates: Sequence[Coordinate]) -> Cycle:
    """Cycle of the variables."""
    lift_off, touch_down = (
        State(
            vertcat(*(at[f"hip_{axis}_{switch}_m"] for axis in "xyz")),
            vertcat(*(at[f"hip_v{axis}_{switch}_m_s"] for axis in "xyz")),
            vertcat(*(at[f"{c.name}_{switch}_rad"] for c in coordinates)),
            vertcat(*(at[f"{c.rate}_{switch}_rad_s"] for c in coordinates)),
        )
        for switch in SWITCHES
    )
    single, double = (fmax(at[time], LEAST_DURATION) for time in TIMES.values())
    images = DM([c.image for c in coordinates])
    return Cycle(lift_off, touch_down, at[LIFT], single, double, fmax(at[STEP], LEAST_STEP), images)


def between(start: State, end: State, duration: SX, phase: SX) -> tuple[Motion, tuple[Motion, ...]]:
    """Motion of the hip (3,) [m] and of every coordinate [rad] from state to state."""
    ends = zip(*(vertsplit(part) for part in (start.hip, end.hip, start.hip_velocity, end.hip_velocity)), strict=True)
    hip = stack(*(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in ends))
    angles = zip(
        *(vertsplit(part) for part in (start.others, end.others, start.others_rate, end.others_rate)), strict=True
    )
    return hip, tuple(cubic(a, b, va, vb, duration, phase) for a, b, va, vb in angles)
