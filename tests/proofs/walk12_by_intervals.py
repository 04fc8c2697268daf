"""The 12-joint walk's proof once more, from the printed formulas, with nothing of the package: intervals and their gradients.

Constants of time are series of `python-flint` with 200 bits. Over boxes of (s, n, H, h), values and gradients are intervals of NumPy,
each operation rounded outward by ``nextafter``; only operations that IEEE 754 rounds correctly are used. A box is dropped by the
mean-value form of the cost or of a knee's reach, loses the slabs that these exclude, and is halved otherwise.

Source:
    Goswami, Vadakkepat, Phung (2008), Table I, eqs. (2)-(11), (14).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest

flint = pytest.importorskip("flint", reason="python-flint not installed")
arb, arb_series, ctx = flint.arb, flint.arb_series, flint.ctx
Array = np.ndarray[Any, np.dtype[np.float64]]

# Table I [kg, m]: masses of knee, waist, foot and hip; lengths of thigh and shank; height of the foot's mass.
KNEE, WAIST, FOOT, HIP = 0.07, 0.02, 0.14, 0.21
THIGH, SHANK, SOLE, WIDTH = 0.19, 0.15, 0.02, 0.12
GRAVITY, F1_MAX, F2_MAX, KAPPA = 9.81, 442.522, 0.13, 0.05
ROOT = ((0.05, 0.13), (0.001, 0.13), (0.001, 0.13), (0.001, 0.13))  # (7)
SLACK = 1e-6  # with which a row counts as satisfied
BATCH = 512
# Weight of an edge's width against its effect on the cost, for the choice of the cut; it decides the time, not the result.
WIDTH_WEIGHT = 0.05
SHRUNK = 0.7  # share of an edge


class Ends(NamedTuple):
    """Lower and upper ends of intervals."""

    lo: Array
    hi: Array

    def __add__(self, other: Ends) -> Ends:  # type: ignore[override]
        return widen(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Ends) -> Ends:
        return widen(self.lo - other.hi, self.hi - other.lo)

    def __mul__(self, other: Ends) -> Ends:  # type: ignore[override]
        products = (self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)
        low, high = np.minimum(*products[:2]), np.maximum(*products[:2])
        return widen(
            np.minimum(low, np.minimum(*products[2:])),
            np.maximum(high, np.maximum(*products[2:])),
        )

    def at(self, *place: Any) -> Ends:
        return Ends(self.lo[place], self.hi[place])


def widen(lo: Array, hi: Array) -> Ends:
    """Round outward; what is not a number is unbounded."""
    lo, hi = np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf)
    bad = np.isnan(lo) | np.isnan(hi)
    if bad.any():
        lo, hi = np.where(bad, -np.inf, lo), np.where(bad, np.inf, hi)
    return Ends(lo, hi)


def number(value: float) -> Ends:
    """Return a double as an interval."""
    return Ends(np.full(1, value), np.full(1, value))


def reciprocal(x: Ends) -> Ends:
    """Return 1 / x of a positive interval; unbounded where it may not be positive."""
    lo = np.where(x.lo > 0.0, x.lo, np.nan)
    return widen(1.0 / x.hi, 1.0 / lo)


@dataclass(frozen=True, eq=False)
class Slope:
    """Value (P, ...) and gradient (4, P, ...) over boxes."""

    value: Ends
    gradient: Ends

    def __add__(self, other: Slope | Ends) -> Slope:
        if isinstance(other, Ends):
            return Slope(self.value + other, self.gradient)
        return Slope(self.value + other.value, self.gradient + other.gradient)

    def __sub__(self, other: Slope) -> Slope:
        return Slope(self.value - other.value, self.gradient - other.gradient)

    def __mul__(self, other: Slope | Ends) -> Slope:
        if isinstance(other, Ends):
            return Slope(self.value * other, self.gradient * other)
        if other is self:
            return self.squared()
        return Slope(self.value * other.value, self.gradient * other.value + other.gradient * self.value)

    def at(self, place: Any) -> Slope:
        return Slope(self.value.at(..., place), self.gradient.at(..., place))

    def squared(self) -> Slope:
        lo, hi = np.abs(self.value.lo), np.abs(self.value.hi)
        inside = (self.value.lo <= 0.0) & (self.value.hi >= 0.0)
        low, high = np.where(inside, 0.0, np.minimum(lo, hi)), np.maximum(lo, hi)
        square = widen(low * low, high * high)
        square = Ends(np.maximum(square.lo, 0.0), square.hi)
        return Slope(square, self.gradient * (self.value * number(2.0)))

    def inverse(self) -> Slope:
        """Return the reciprocal of a positive value; unbounded where it may not be positive."""
        inverse = reciprocal(self.value)
        return Slope(inverse, self.gradient * (inverse * inverse * number(-1.0)))

    def root(self) -> Slope:
        """Return the square root of a positive value; unbounded where it may not be positive."""
        lo = np.where(self.value.lo > 0.0, self.value.lo, np.nan)
        root = widen(np.sqrt(lo), np.sqrt(self.value.hi))
        return Slope(root, self.gradient * (reciprocal(root) * number(0.5)))


class Moving(NamedTuple):
    """A quantity with its first two derivatives in time."""

    p: Slope
    v: Slope
    a: Slope

    def times(self, other: Moving) -> Moving:
        crossed = self.v * other.v
        return Moving(
            self.p * other.p,
            self.p * other.v + self.v * other.p,
            self.p * other.a + (crossed + crossed) + self.a * other.p,
        )

    def plus(self, other: Moving) -> Moving:
        return Moving(*(mine + its for mine, its in zip(self, other, strict=True)))

    def minus(self, other: Moving) -> Moving:
        return Moving(*(mine - its for mine, its in zip(self, other, strict=True)))

    def scaled(self, factor: Ends) -> Moving:
        return Moving(*(part * factor for part in self))

    def through(self, f: Slope, first: Slope, second: Slope) -> Moving:
        """Return a function of this quantity, from its value and derivatives."""
        return Moving(f, first * self.v, second * (self.v * self.v) + first * self.a)




class Step(NamedTuple):
    """Constants of time of the first step at K samples: values and two derivatives, each (K,)."""

    share: list[Ends]  # P12x / s (4)
    lift: list[Ends]  # P12z / H (4)
    shift: list[Ends]  # P6y / n (6)
    weights: Ends  # of the integral (9)
    limited: Any  # samples at which the reach is limited


def sample_step(times: list[Any], weights: list[Any], limited: Any) -> Step:
    """Return the constants at rational times of a step of 1 s."""

    def ends(values: list[Any]) -> Ends:
        return widen(np.array([float(v.lower()) for v in values]), np.array([float(v.upper()) for v in values]))

    with ctx.workprec(200):
        half, pi, found = arb(1) / 2, arb.pi(), []
        for time in times:
            t = arb_series([time, 1], prec=3)
            share = ((t - half) * pi).sin() * half
            swell = (((t * (pi / 2)).sin() + 1) * (pi / 2)).sin()
            found.append((share, ((share + half) * pi).sin(), swell * (t * pi).sin()))
        parts = [[ends([row[k][order] * (1, 1, 2)[order] for row in found]) for order in range(3)] for k in range(3)]
        return Step(parts[0], parts[1], parts[2], ends(weights), limited)


def simpson(intervals: int) -> Step:
    """Return the samples of Simpson's rule; the reach is limited at the ends of its panels."""
    with ctx.workprec(200):
        parts = [1 if k in (0, intervals) else 4 if k % 2 else 2 for k in range(intervals + 1)]
        weights = [arb(part) / (3 * intervals) for part in parts]
        return sample_step([arb(k) / intervals for k in range(intervals + 1)], weights, slice(0, None, 2))


def evaluate(boxes: Ends, step: Step, weight: float, gradients: bool = True) -> tuple[Slope, Slope]:
    """Return the cost -f (P,) and the cosines of the knees (P, R) over boxes (P, 4)."""
    unit = np.eye(4)[:, None, :] if gradients else np.empty((0, 1, 4))
    s, n, H, h = (
        Slope(boxes.at(slice(None), slice(i, i + 1)), Ends(unit[..., i : i + 1], unit[..., i : i + 1])) for i in range(4)
    )
    zero = Slope(Ends(np.zeros((1, 1)), np.zeros((1, 1))), Ends(np.zeros_like(unit[..., :1]), np.zeros_like(unit[..., :1])))
    still = Moving(zero, zero, zero)

    def follow(variable: Slope, parts: list[Ends]) -> Moving:
        return Moving(*(variable * part for part in parts))

    half = number(0.5)
    ankle_x, ankle_z = follow(s, step.share), follow(H, step.lift)  # (4); the ankle is w to the right of the other
    hip_x, hip_y = ankle_x.scaled(half), follow(n, step.shift)  # (6)
    hip_z = still._replace(p=h * number(-1.0) + (number(THIGH) + number(SHANK)))
    moments = [zero, zero]

    def add_mass(mass: float, x: Moving, y: Moving, z: Moving) -> None:
        for axis, place in enumerate((x, y)):
            moment = (z.a + number(GRAVITY)) * place.p - place.a * z.p
            moments[axis] = moments[axis] + moment * number(mass)

    aside = number(WIDTH) * number(-1.0)
    lower, upper = number(SHANK) * number(SHANK), number(THIGH) * number(THIGH)
    difference = (lower - upper) * half
    height, cosines = number(SOLE) * reciprocal(number(SHANK)), list[Slope]()
    for ankle, y_ankle, line in (
        ((still, still, still), number(0.0), (hip_x, hip_y, hip_z)),
        ((ankle_x, still, ankle_z), aside, (hip_x.minus(ankle_x), hip_y, hip_z.minus(ankle_z))),
    ):
        # The knee is off the line from ankle to hip, in front of it (2), (3); `share` and `off` are shares of the line.
        x, y, z = line
        up_squared = y.times(y).plus(z.times(z))
        q = x.times(x).plus(up_squared)
        y_q = q.p.inverse()
        by_q = q.through(y_q, y_q.squared() * number(-1.0), y_q * y_q.squared() * number(2.0))
        share = by_q.scaled(difference)
        share = share._replace(p=share.p + half)
        off = (y_q * (lower - difference) - y_q.squared() * (difference * difference) + number(-0.25)).root()
        by_off = off.inverse()
        slope = (y_q * (difference * difference * number(-2.0)) + (lower - difference)) * by_off * half
        across = by_q.through(off, slope, (slope.squared() + difference * difference) * by_off * number(-1.0))
        root = up_squared.p.root()
        by_root = root.inverse()
        up = up_squared.through(root, by_root * half, by_root * by_root.squared() * number(-0.25))
        by_up = up.through(by_root, by_root.squared() * number(-1.0), by_root * by_root.squared() * number(2.0))
        sideways = share.minus(across.times(x.times(by_up)))
        knee = share.times(x).plus(across.times(up)), sideways.times(y), sideways.times(z)
        for mass, part in ((KNEE, number(1.0)), (FOOT, height)):
            place = [base.plus(off_.scaled(part)) for base, off_ in zip(ankle, knee, strict=True)]
            add_mass(mass, place[0], place[1]._replace(p=place[1].p + y_ankle), place[2])
        by_twice = reciprocal(number(2.0) * number(THIGH) * number(SHANK))
        cosines.append((q.p + (lower + upper) * number(-1.0)) * by_twice)
    for mass, shift in ((HIP, number(0.0)), (HIP, aside), (WAIST, aside * half)):
        add_mass(mass, hip_x, hip_y._replace(p=hip_y.p + shift), hip_z)
    total = number(2.0) * (number(KNEE) + number(FOOT) + number(HIP)) + number(WAIST)
    zmp = [moment * reciprocal(total * number(GRAVITY)) for moment in moments]  # (14)
    Q = sum_last((zmp[0].squared() + zmp[1].squared()) * step.weights)  # (9)
    stability = Q.inverse() * (number(weight) * reciprocal(number(F1_MAX)))  # (10)
    speed = sum_last(s) * ((number(1.0) - number(weight)) * reciprocal(number(F2_MAX)))
    reach = [part.at(step.limited) for part in cosines]
    joined = Slope(*(Ends(*(np.concatenate([getattr(r, name)[k] for r in reach], axis=-1) for k in (0, 1))) for name in ("value", "gradient")))
    return (stability + speed) * number(-1.0), joined  # (11)


def sum_last(x: Slope) -> Slope:
    """Return the sum over samples."""
    parts = [Slope(x.value.at(..., k), x.gradient.at(..., k)) for k in range(x.value.lo.shape[-1])]
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


class Tree(NamedTuple):
    """Result of branch and bound."""

    boxes: int  # evaluated
    left: int  # neither dropped nor halved; 0 if the bound is proven


def prove(step: Step, weight: float, bound: float, root: Any = ROOT, at_most: int = 10**9, progress: Any = None) -> Tree:
    """Prove that no x in a box that the judge accepts has f above a bound, or stop after so many boxes."""
    ends = np.array(root, dtype=float).T[:, None, :]
    open_, boxes, target = Ends(ends[0], ends[1]), 0, number(-bound)
    limit = float(np.cos(KAPPA)) + 1e-12 + SLACK
    with np.errstate(all="ignore"):
        while len(open_.lo) and boxes < at_most:
            now, open_ = open_.at(slice(-BATCH, None)), open_.at(slice(0, -BATCH))
            boxes += len(now.lo)
            new = Ends(*(np.concatenate(pair) for pair in zip(open_, _prune(now, step, weight, target, limit), strict=True)))
            open_ = new
            if progress is not None:
                progress(boxes, open_)
    return Tree(boxes, len(open_.lo))


def _prune(now: Ends, step: Step, weight: float, target: Ends, limit: float) -> Ends:
    """Return what remains of boxes, halved where little was cut off."""
    cost, reach = evaluate(now, step, weight)
    keep = (cost.value.lo < target.lo) & (reach.value.lo <= limit).all(axis=-1)
    now, cost, reach = now.at(keep), _choose(cost, keep), _choose(reach, keep)
    middle = 0.5 * now.lo + 0.5 * now.hi
    cost_there, reach_there = evaluate(Ends(middle, middle), step, weight, gradients=False)
    # Rows value <= limit, the cost first: value(middle) + gradient (x - middle) <= limit.
    there = np.concatenate([cost_there.value.lo[:, None], reach_there.value.lo], axis=1)
    limits = np.concatenate([target.hi, np.full(reach.value.lo.shape[-1], limit)])
    low, high = (
        np.concatenate([c[..., None], r], axis=-1).transpose(1, 2, 0)
        for c, r in zip(cost.gradient, reach.gradient, strict=True)
    )
    offset = Ends(now.lo, now.hi) - Ends(middle, middle)
    part = Ends(low, high) * Ends(offset.lo[:, None, :], offset.hi[:, None, :])
    room = limits - there  # rounded to nearest: the slack below is far more
    least = part.lo.sum(axis=-1, keepdims=True)
    room = (room[..., None] - (least - part.lo)) + 1e-13 * (1.0 + np.abs(part.lo).sum(axis=-1, keepdims=True) + np.abs(there[..., None]))
    known = np.isfinite(room)
    to_high = np.where(known & (low > 0.0), room / np.where(room >= 0.0, low, high), np.inf).min(axis=1)
    to_low = np.where(known & (high < 0.0), room / np.where(room >= 0.0, high, low), -np.inf).max(axis=1)
    lo = np.maximum(now.lo, np.nextafter(middle + to_low, -np.inf) - 1e-15)
    hi = np.minimum(now.hi, np.nextafter(middle + to_high, np.inf) + 1e-15)
    # A row that is violated anywhere: its least value is above the limit.
    lost = (np.where(known[..., 0], room[..., 0] - part.lo[..., 0], np.inf) < 0.0).any(axis=1) | (lo > hi).any(axis=1)
    lo, hi, width = lo[~lost], hi[~lost], (now.hi - now.lo)[~lost]
    effect = np.maximum(np.abs(low[~lost, 0]), np.abs(high[~lost, 0])) * (hi - lo)
    effect = np.where(np.isfinite(effect), effect, 1.0)
    relative = (hi - lo) / (np.array(ROOT)[:, 1] - np.array(ROOT)[:, 0])
    shares = effect / effect.sum(axis=1, keepdims=True) + WIDTH_WEIGHT * relative / relative.max(axis=1, keepdims=True)
    cut = shares.argmax(axis=1)
    again = (hi - lo < SHRUNK * width).any(axis=1)  # narrow enough to be bounded again as it is
    index = np.arange(len(cut))[~again], cut[~again]
    split = 0.5 * lo[index] + 0.5 * hi[index]
    left_hi, right_lo = hi[~again].copy(), lo[~again].copy()
    rows = np.arange(len(split))
    left_hi[rows, index[1]], right_lo[rows, index[1]] = split, split
    return Ends(np.concatenate([lo[again], lo[~again], right_lo]), np.concatenate([hi[again], left_hi, hi[~again]]))


def _choose(x: Slope, keep: Any) -> Slope:
    return Slope(Ends(x.value.lo[keep], x.value.hi[keep]), Ends(x.gradient.lo[:, keep], x.gradient.hi[:, keep]))
