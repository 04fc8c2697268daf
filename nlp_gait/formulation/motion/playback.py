"""What a physics engine needs to play a motion, beside its time histories."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nlp_gait.formulation.assembly import NumericPoint
from nlp_gait.formulation.motion.signals import Columns, Signals, in_space
from nlp_gait.robots import Robot

# Beside q, qd and tau of the robot's joints: what the engine is given of a motion; the floor, or its lowest part, is at z = 0.
PLAYED = {
    "zmp": in_space("m", "xy"),  # planned centre of pressure of everything that stands on the ground
    "hip": in_space("m"),  # origin of the robot's root
    "attitude": Columns(
        unit="1", labels=("w", "x", "y", "z")
    ),  # of the root, a quaternion; upright where it is missing
    "left_foot": in_space("m"),  # the sole under the ankle
    "right_foot": in_space("m"),
    # 1 where any part of the foot is on the ground, else 0; where it is missing, a foot is on it when its sole is.
    "left_bears": Columns(unit="1"),
    "right_bears": Columns(unit="1"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tread:
    """Level part of a staircase, from its edge onwards until the next one rises.

    Attributes:
        edge_m: x of its edge.
        height_m: above the floor.
    """

    edge_m: float
    height_m: float


# From a gait and a number of steps to its time histories, or to what it climbs.
Performed = Callable[[NumericPoint, int], Signals]
Climbed = Callable[[NumericPoint, int], tuple[Tread, ...]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Playback:
    """How a gait is played.

    Attributes:
        robot: as the model takes it: links welded that never move.
        gravity: [m/s^2].
        heat_loss: parameter that holds the heat constant K [W/(Nm)^2]; None for motors without known heat.
        repeats: several steps can be played one after the other.
        motion: time histories of so many steps on a dense grid, in the robot's joints and with the arrays of ``PLAYED``; None
            where the problem's own are that already, and the next step is the mirror image of the one before.
        ground: the stairs that so many steps lead up; None for a flat floor.
        planar: the root moves in the sagittal plane only.
    """

    robot: Robot
    gravity: float
    heat_loss: str | None = None
    repeats: bool = False
    motion: Performed | None = None
    ground: Climbed | None = None
    planar: bool = False
