"""What shows the gaits of a problem: time histories, stick figures, and what a physics engine needs to simulate them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from nlp_gait.formulation.assembly import NumericPoint
from nlp_gait.formulation.signals import Columns, Signals, vector_columns
from nlp_gait.formulation.stick_figure import Skeleton

# A ``nlp_gait.robots.Robot``. This package only passes it on, so it does not import it.
RobotModel: TypeAlias = Any

# What the engine needs of a motion in addition to the joints' q, qd and tau. The floor, or its lowest part, is at z = 0.
SIMULATED = {
    "zmp": vector_columns("m", "xy"),  # planned centre of pressure of everything that stands on the ground
    "hip": vector_columns("m"),  # origin of the robot's root
    "attitude": Columns(unit="1", labels=("w", "x", "y", "z")),  # of the root, a quaternion; upright if missing
    "left_foot": vector_columns("m"),  # the sole under the ankle
    "right_foot": vector_columns("m"),
    # 1 where any part of the foot is on the ground, else 0; if missing, a foot is on the ground when its sole is.
    "left_bears": Columns(unit="1"),
    "right_bears": Columns(unit="1"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tread:
    """Level part of a staircase, from its edge to the next one."""

    edge_m: float  # x of its edge
    height_m: float  # above the floor


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulationModel:
    """What a physics engine needs of a problem."""

    robot: RobotModel  #: as the engine models it, where links that never move are welded
    gravity: float  #: [m/s^2]
    heat_loss: str | None = None  #: parameter with the heat constant K [W/(Nm)^2]; None for motors without known heat
    repeats: bool = False  #: several steps can be simulated one after the other
    #: From a point and a number of steps to time histories on a dense grid, in the robot's joints and with the arrays of
    #: ``SIMULATED``; None if those of the problem are that already, and the next step is the mirror image
    motion: Callable[[NumericPoint, int], Signals] | None = None
    #: From a point and a number of steps to the stairs; None for a flat floor
    ground: Callable[[NumericPoint, int], tuple[Tread, ...]] | None = None
    planar: bool = False  #: the root moves in the sagittal plane only


@dataclass(frozen=True, kw_only=True, eq=False)
class Display:
    """What shows the gaits of a problem; no solver reads it."""

    motion: Callable[[NumericPoint], Signals] | None = None  #: time histories at a point of numbers
    #: Stick figures from time histories and the parameters by name
    skeleton: Callable[[Signals, Mapping[str, float]], Skeleton] | None = None
    simulation_model: SimulationModel | None = None  #: what a physics engine needs
    robot: RobotModel | None = None  #: whose joints move, if it is a tree of rigid links
    durations: tuple[str, ...] = ()  #: variables with the duration of each phase, in order
