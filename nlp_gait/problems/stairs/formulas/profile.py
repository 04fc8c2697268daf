"""The staircase: two steps, and a height that the feet must not fall below."""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

import casadi as ca
from casadi import SX

E = TypeVar("E")


class Stair(NamedTuple, Generic[E]):
    """Two equal steps; the stance ankle stands at the origin, the rear ankle one tread back and one rise down.

    Attributes:
        tread: X, from ankle to ankle of neighbouring steps [m].
        rise: Z, of one step [m].
    """

    tread: E
    rise: E


def stair_height(x: SX, stair: Stair[SX], setback: float, width: float) -> SX:
    """Height of the ground under a point, relative to the stance ankle [m].

    Args:
        x: position of the point [m].
        stair: steps.
        setback: the edge of each step lies so far behind the ankle that stands on it [m].
        width: an edge is a sigmoid; half of its rise happens within 2.2 widths [m].
    """

    def edge(at: SX | float) -> SX:
        return 0.5 * (1 + ca.tanh((x - at + setback) / (2 * width)))

    return stair.rise * (edge(0.0) + edge(stair.tread) - 1)
