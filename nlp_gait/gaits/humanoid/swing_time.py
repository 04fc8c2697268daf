"""How fast a robot can swing a leg: from it follow the bounds on times and velocities of robots of other sizes than NAO's."""

from __future__ import annotations

import math

from nlp_gait.robots.biped import NAO_LEG_M, Biped

GRAVITY = 9.81  # [m/s^2]
STEP_M = 0.06  # NAO's, from foot to foot
NAO_SWING_S = 0.4  # least time of NAO's swings in its papers
LIKE_NAO = 0.1  # legs whose length differs by at most this share from NAO's have the papers' bounds


def compare_swing(biped: Biped) -> float:
    """Return by how much a robot can swing faster than NAO does in its papers, in proportion; at least 1.

    It is 1 for robots of NAO's size, and where the file has no torque: one that could hold the whole robot on a stretched leg.
    """
    largest = biped.full.mass_kg * GRAVITY * biped.leg_length_m
    if abs(biped.length_scale - 1.0) <= LIKE_NAO or _find_hip(biped)[1] > largest:
        return 1.0
    return max(float(f"{NAO_SWING_S * biped.time_scale / find_least_swing_time(biped):.2g}"), 1.0)


def find_least_swing_time(biped: Biped) -> float:
    """Return the least time in which the hip carries a leg over two usual steps [s].

    The angle is a cubic of time from rest to rest, within the joint's speed and torque; the leg is a rod of its mass.
    """
    speed, torque = _find_hip(biped)
    angle = 2 * STEP_M / NAO_LEG_M
    mass_kg = sum(biped.model.links[biped.model.joint(name).child].mass_kg for name in biped.legs["left"].joints)
    inertia = mass_kg * biped.leg_length_m**2 / 3
    return max(1.5 * angle / speed, math.sqrt(6 * angle * inertia / torque))


def _find_hip(biped: Biped) -> tuple[float, float]:
    """Speed and torque of the hip joint that swings the leg forward [rad/s, Nm]."""
    leg = biped.legs["left"]
    name, _ = max(zip(leg.joints[:3], leg.axes[:3].tolist(), strict=True), key=lambda pair: abs(pair[1][1]))
    joint = biped.model.joint(name)
    return joint.velocity_limit_rad_s, joint.torque_limit_Nm
