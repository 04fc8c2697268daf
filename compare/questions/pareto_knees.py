"""Knees of a front: where it bends, by its distance from the chord and by the multipliers, which are its slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.questions.pareto_front import FrontPoint

# A bend is a knee if the front turns by so much [rad] within a tenth of its length, the ranges of both objectives being 1.
LEAST_TURN = np.pi / 6
WINDOW = 0.1


@dataclass(frozen=True, kw_only=True)
class Knee:
    """A point at which the front bends away from the better values.

    Attributes:
        value: of the criterion.
        power_W: there.
        price_before: slope just below it [W per unit].
        price_after: slope just above it [W per unit].
        turn_deg: by how much the front turns around it, with both ranges as 1 [degree].
        chord_distance: from the straight line between the front's ends, with both ranges as 1; negative behind it.
    """

    value: float
    power_W: float
    price_before: float
    price_after: float
    turn_deg: float
    chord_distance: float


@dataclass(frozen=True, kw_only=True)
class Bends:
    """How a front bends.

    Attributes:
        knees: bends, by rising criterion.
        farthest: number of the point farthest from the chord, on its better side.
        convex: no piece is flatter than the one before it by more than a hundredth of its slope: then there is one knee at
            most in the sense of the chord.
    """

    knees: tuple[Knee, ...]
    farthest: int
    convex: bool


def bends(front: Sequence[FrontPoint]) -> Bends:
    """Knees of a front (at least three points, by rising criterion), from its points alone.

    The direction of each piece between neighbours is taken with both ranges as 1. A knee is a stretch of at most a tenth of
    the front's length over which the direction turns by at least 30 degrees towards dearer; of overlapping stretches the one
    that turns most counts, and its sharpest point is given. The prices beside it come from the multipliers.
    """
    value, power = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
    across, up = np.diff(value) / np.ptp(value), np.diff(power) / np.ptp(power)
    length = np.hypot(across, up)
    angle = np.arctan2(up, across)
    turn = np.concatenate([[0.0], np.diff(angle), [0.0]])
    along = np.concatenate([[0.0], np.cumsum(length)])
    # From the better side: the chord lies above a convex front.
    chord = ((value - value[0]) / np.ptp(value) - (power - power[0]) / np.ptp(power)) / np.sqrt(2)
    half = WINDOW * along[-1] / 2
    total = np.array([turn[np.abs(along - here) <= half].sum() for here in along])
    free = np.ones(len(front), dtype=bool)
    knees = []
    while free.any() and total[free].max() >= LEAST_TURN:
        centre = int(np.flatnonzero(free)[np.argmax(total[free])])
        stretch = np.flatnonzero(np.abs(along - along[centre]) <= half)
        sharpest = int(stretch[np.argmax(turn[stretch])])
        knees.append(
            Knee(
                value=float(value[sharpest]),
                power_W=float(power[sharpest]),
                price_before=front[max(0, stretch[0] - 1)].price,
                price_after=front[min(len(front) - 1, stretch[-1] + 1)].price,
                turn_deg=float(np.degrees(total[centre])),
                chord_distance=float(chord[sharpest]),
            )
        )
        free &= np.abs(along - along[centre]) > 2 * half
    slope = up / across
    return Bends(
        knees=tuple(sorted(knees, key=lambda knee: knee.value)),
        farthest=int(np.argmax(chord)),
        convex=bool(np.all(slope[1:] >= slope[:-1] * 0.99)),
    )
