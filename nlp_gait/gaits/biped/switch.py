"""A switch between two phases: the states of hip and coordinates at it, their variables, and the rows that join the phases."""

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, MX, SX, vertcat

from nlp_gait.formulation import Constraint, InstantPoint, Point, Variable
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.body import Body, Coordinate
from nlp_gait.gaits.biped.bounds import make_hip_variables
from nlp_gait.gaits.biped.limits import make_rows
from nlp_gait.gaits.biped.samples import Samples

SWITCHES = ("lift_off", "touch_down")
# Ranges of the hip's place ahead of the left foot as shares of a leg's length: generous, so that reach and balance decide. NAO's
# legs are 0.2029 m long.
HIP_X_SHARES = {"lift_off": (-0.25, 0.25), "touch_down": (-0.1, 0.5)}
SUFFIXES = {"m": "m", "m/s": "m_s", "rad": "rad", "rad/s": "rad_s"}
TORQUE_JUMP = "torque_jump_limit_Nm"


class SwitchState(NamedTuple):
    """Hip (3,) and coordinates (k,) at a switch: position with velocity [m, m/s], angles with their rates [rad, rad/s]."""

    hip: SX
    hip_velocity: SX
    angles: SX
    angle_rates: SX


def limit_torque_jump(
    switch: str, body: Body, point: Point, before: Samples, after: Samples, *, mirrored: bool = False
) -> tuple[Constraint, dict[str, MX]]:
    """Return the row that limits the jumps of torques at a switch, and an index, the largest one [Nm].

    Positions and rates are continuous. With ``mirrored`` the mirror image of the phase follows, as after the last one of a cycle.
    """
    images, signs = body.mirror
    first = DM(signs) * after.torque[images, 0] if mirrored else after.torque[:, 0]
    jump, limit, name = first - before.torque[:, -1], point[TORQUE_JUMP], f"{switch}_torque_jump"
    row = make_rows(name, "Nm", jump, -limit, limit, body.joints, "once", body.torque_scale)
    return row, {f"{name}_Nm": ca.mmax(ca.fabs(jump))}


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


def read_state(point: InstantPoint, name: str, coordinates: Sequence[Coordinate]) -> SwitchState:
    """State of the variables whose names contain ``name``."""
    velocity = vertcat(*(point[f"hip_v{axis}_{name}_m_s"] for axis in "xyz"))
    hip = vertcat(*(point[f"hip_{axis}_{name}_m"] for axis in "xyz"))
    rates = vertcat(*(point[f"{c.rate}_{name}_rad_s"] for c in coordinates))
    return SwitchState(hip, velocity, vertcat(*(point[f"{c.name}_{name}_rad"] for c in coordinates)), rates)
