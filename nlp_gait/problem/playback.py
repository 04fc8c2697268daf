"""What a physics engine needs to play a motion, beside its time histories."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from nlp_gait.problem.signals import Array, Signals
from nlp_gait.robots import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """A foot that stands, and what it carries.

    Attributes:
        foot: ``"left"`` or ``"right"``.
        joints: of the tree above it; None for all.
        torso_share: (T,) part of the torso's mass that it carries; None for the whole torso.
    """

    foot: str
    joints: tuple[str, ...] | None = None
    torso_share: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Playback:
    """How a gait is played.

    Attributes:
        robot: as the model takes it: links welded that never move.
        gravity: [m/s^2].
        heat_loss: parameter that holds the heat constant K [W/(Nm)^2].
        repeats: one step, whose mirror image is the next one.
        supports: how the model divides the robot among its feet, from its time histories; None where it does so phase by
            phase.
    """

    robot: Robot
    gravity: float
    heat_loss: str
    repeats: bool = False
    supports: Callable[[Signals], Sequence[Support]] | None = None
