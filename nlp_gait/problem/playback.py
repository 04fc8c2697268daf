"""What a physics engine needs to play a motion, beside its time histories."""

from __future__ import annotations

from dataclasses import dataclass

from nlp_gait.robots import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Playback:
    """How a gait is played.

    Attributes:
        robot: as the model takes it: links welded that never move.
        gravity: [m/s^2].
        heat_loss: parameter that holds the heat constant K [W/(Nm)^2].
        repeats: one step, whose mirror image is the next one.
    """

    robot: Robot
    gravity: float
    heat_loss: str
    repeats: bool = False
