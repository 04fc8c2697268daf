"""What a posture on the stairs asks of joints and ground while the stance foot stands flat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic, NamedTuple, TypeVar

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.gaits.stairs.formulas.planar_biped import LINKS, Rod, biped_dynamics, centres, points

# Links that move while the stance foot stands flat: coordinates q of the model.
MOVING = LINKS[:7]
# Joints between them, from the stance foot to the swing toe.
JOINTS = ("ankle'", "knee'", "hip'", "hip", "knee", "ankle", "toe")
# Joint rates are JOINT_RATES @ qd: differences of absolute link rates. The torso's angle runs the other way.
JOINT_RATES = np.array(
    [  # HK, KA, HK', K'A', UH, AS, ST
        [0, 0, 0, 1, 0, 0, 0],
        [0, 0, 1, -1, 0, 0, 0],
        [0, 0, 1, 0, 1, 0, 0],
        [1, 0, 0, 0, 1, 0, 0],
        [-1, 1, 0, 0, 0, 0, 0],
        [0, -1, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, -1, 1],
    ]
)
# In free fall there is no pressure below the foot: a smaller stance force counts as this share of the weight in its centre.
LEAST_LOAD = 1e-3


E = TypeVar("E")


class StanceLoads(NamedTuple, Generic[E]):
    """What joints and ground must give.

    Attributes:
        torque: (7,) of the joints [Nm], in the order of JOINTS.
        stance_force: (2,) of the ground on the stance foot [N].
        stance_pressure: its centre of pressure, ahead of the stance ankle [m].
    """

    torque: E
    stance_force: E
    stance_pressure: E


def link_angles(q: SX) -> SX:
    """(9,) absolute angles of all links with the stance foot flat [rad], from q (7,)."""
    return ca.vertcat(q, 0, 0)


def loads(rods: Mapping[str, Rod], gravity: float, q: SX, qd: SX, qdd: SX, rear: Mapping[str, SX]) -> StanceLoads[SX]:
    """Inverse dynamics with given forces below the rear foot.

    Args:
        rods: of the robot.
        gravity: [m/s^2].
        q: (7,) absolute angles of the links in MOVING [rad]; symbols, for derivatives are taken with respect to them.
        qd: (7,) rates [rad/s]; symbols.
        qdd: (7,) [rad/s^2].
        rear: forces of the ground (2,) [N] by the point of the rear foot on which they act.

    Source:
        Bhardwaj et al., eqs. (35), (42); the centre of pressure from the moment balance of the flat stance foot.
    """
    motion = biped_dynamics(rods, gravity, q, qd, link_angles(q))
    found = points(rods, link_angles(q), SX(2, 1))
    generalised = motion.M @ qdd + motion.C @ qd + motion.G  # (eq. 42)
    for point, force in rear.items():
        generalised -= ca.jacobian(found[point], q).T @ force  # (eq. 35)
    torque = DM(np.linalg.inv(JOINT_RATES.T)) @ generalised

    middles = centres(found)
    mass = sum(rod.mass for rod in rods.values())
    momentum = sum((rods[link].mass * ca.jtimes(middles[link], q, qd) for link in LINKS), SX(2, 1))
    force = ca.jtimes(momentum, q, qd) + ca.jtimes(momentum, qd, qdd) + ca.vertcat(0, mass * gravity)
    stance = force - sum(rear.values(), SX(2, 1))
    foot = sum((rods[link].mass * gravity * middles[link][0] for link in ("A'S'", "S'T'")), SX(0))
    load = ca.fmax(stance[1], LEAST_LOAD * mass * gravity)
    return StanceLoads(torque, stance, (foot - torque[0]) / load)
