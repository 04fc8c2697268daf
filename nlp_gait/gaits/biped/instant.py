"""One instant of a spatial biped: how it moves, and what that asks of motors and ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from casadi import SX

from nlp_gait.formulation import InstantPoint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

BOTH_FEET = {"L": "left", "R": "right"}


class PlannedInstant(NamedTuple):
    """Motion of the whole robot at one instant.

    Attributes:
        joints: motion of every joint by name [rad].
        hip: (3,) position of the torso's origin [m].
        ankles: (3,) positions by side ``"L"``, ``"R"`` [m].
        reach: (2,) cosines of the left and the right knee.
        wrench: (6,) of the ground on the right sole, about the point under its ankle [N, Nm]; empty where it is not planned.
        miss: (k,) by how much legs miss their feet [m]; empty where they cannot.
        attitude: (4,) of the torso, a unit quaternion (w, x, y, z); empty where it is upright.
    """

    joints: Mapping[str, Motion]
    hip: SX
    ankles: Mapping[str, SX]
    reach: SX
    wrench: SX = SX(0, 1)
    miss: SX = SX(0, 1)
    attitude: SX = SX(0, 1)


class Loads(NamedTuple):
    """What motors and ground must give at one instant.

    Attributes:
        torques: by joint name [Nm].
        zmp: (2,) in the world [m].
        wrenches: (6,) of the ground on each sole by side, about the point under its ankle [N, Nm].
    """

    torques: Mapping[str, SX]
    zmp: SX
    wrenches: Mapping[str, SX]


# From the phase's variables and the reach margin by name, the phase in [0, 1], and an interpretation of acos.
Planner = Callable[[InstantPoint, SX, Nonsmooth], PlannedInstant]
# From joint motions by name, the hip's position (3,), points (2,) on the ground under the ankles by side, and what is planned
# of the ground's wrench on the right sole.
Loader = Callable[[Mapping[str, Motion], SX, Mapping[str, SX], SX], Loads]
