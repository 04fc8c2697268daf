"""Knees of a front: where it bends, by its distance from the chord and by the multipliers, which are its slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.questions.pareto.front import FrontPoint
from nlp_gait.formulation import Array

# A bend is a knee if the front turns by this much [rad] within this part of its length, the ranges of both objectives being 1.
LEAST_TURN = np.pi / 12
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

    A knee is a point at which the straight line from the point a twentieth of the front's length before it, and that to the
    point as far behind it, differ in direction by at least 15 degrees, towards dearer, both ranges being 1; so a point that
    lies a little off makes none. Of those within a tenth of the length the sharpest counts. The prices beside it come from
    the multipliers.
    """
    value, power = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
    across, up = np.diff(value) / np.ptp(value), np.diff(power) / np.ptp(power)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(across, up))])
    scaled = np.column_stack([(value - value[0]) / np.ptp(value), (power - power[0]) / np.ptp(power)])
    # From the better side: the chord lies above a convex front.
    chord = (scaled[:, 0] - scaled[:, 1]) / np.sqrt(2)
    half = WINDOW * along[-1] / 2

    def at(place: Array) -> Array:
        return np.column_stack([np.interp(place, along, scaled[:, k]) for k in (0, 1)])

    before, after = scaled - at(along - half), at(along + half) - scaled
    total = np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    total[(along < half) | (along > along[-1] - half)] = 0.0
    free = np.ones(len(front), dtype=bool)
    knees = []
    while free.any() and total[free].max() >= LEAST_TURN:
        centre = int(np.flatnonzero(free)[np.argmax(total[free])])
        stretch = np.flatnonzero(np.abs(along - along[centre]) <= half)
        knees.append(
            Knee(
                value=float(value[centre]),
                power_W=float(power[centre]),
                price_before=front[max(0, stretch[0] - 1)].price,
                price_after=front[min(len(front) - 1, stretch[-1] + 1)].price,
                turn_deg=float(np.degrees(total[centre])),
                chord_distance=float(chord[centre]),
            )
        )
        free &= np.abs(along - along[centre]) > 2 * half
    slope = up / across
    return Bends(
        knees=tuple(sorted(knees, key=lambda knee: knee.value)),
        farthest=int(np.argmax(chord)),
        convex=bool(np.all(slope[1:] >= slope[:-1] * 0.99)),
    )
