"""How fast a robot can swing a leg: from it follow the bounds on times and velocities of robots of other sizes than NAO's."""

from __future__ import annotations

import math

from nlp_gait.gaits.biped.cycle_motion import STEP_SHARES
from nlp_gait.robots.biped import Biped

NAO_SWING_S = 0.4  # least time of NAO's swings in its papers
LIKE_NAO = 0.1  # legs whose length differs by at most this share from NAO's have the papers' bounds


def find_least_swing_time(biped: Biped) -> float:
    """Return the least time in which the hip joint that swings a leg carries it over two of the shortest steps [s].

    The angle is a cubic of time from rest to rest, within the joint's speed and torque; the leg is a rod of its mass.
    """
    leg = biped.legs["left"]
    joints = [biped.model.joint(name) for name in leg.joints]
    _, hip = max(zip(leg.axes[:3].tolist(), joints[:3], strict=True), key=lambda pair: abs(pair[0][1]))
    angle = 2 * STEP_SHARES[0]
    mass_kg = sum(biped.model.links[joint.child].mass_kg for joint in joints)
    inertia = mass_kg * leg.length_m**2 / 3
    return max(1.5 * angle / hip.velocity_limit_rad_s, math.sqrt(6 * angle * inertia / hip.torque_limit_Nm))


def compare_swing(biped: Biped) -> float:
    """Return by how much a robot can swing faster than NAO's papers do, in proportion; 1 for robots of NAO's size."""
    if abs(biped.length_scale - 1.0) <= LIKE_NAO:
        return 1.0
    return max(float(f"{NAO_SWING_S * biped.time_scale / find_least_swing_time(biped):.2g}"), 1.0)
