"""The 12-joint walk's proof once more, from the printed formulas, with nothing of the package: intervals and their gradients.

It agrees with the judge, proves a bound, and refuses a false one.

Constants of time are series of `python-flint` with 200 bits. Over boxes of (s, n, H, h), values and gradients are intervals of
NumPy, each operation rounded outward by ``nextafter``; only operations that IEEE 754 rounds correctly are used. A box is dropped
by the mean-value form of the cost or of a knee's reach, loses the slabs that these exclude, and is halved otherwise.

Source:
    Goswami, Vadakkepat, Phung (2008), Table I, eqs. (2)-(11), (14).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.gaitbench.facts import load_facts

flint = pytest.importorskip("flint")
arb, arb_series, ctx = flint.arb, flint.arb_series, flint.ctx
Array = np.ndarray[Any, np.dtype[np.float64]]

# Table I [kg, m]: masses of knee, waist, foot and hip; lengths of thigh and shank; height of the foot's mass.
KNEE, WAIST, FOOT, HIP = 0.07, 0.02, 0.14, 0.21
THIGH, SHANK, SOLE, WIDTH = 0.19, 0.15, 0.02, 0.12
GRAVITY, F1_MAX, F2_MAX, KAPPA = 9.81, 442.522, 0.13, 0.05
ROOT = ((0.05, 0.13), (0.001, 0.13), (0.001, 0.13), (0.001, 0.13))  # (7)
NODES, ROUNDED = 16, 1e-14  # of Gauss's rule
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


Point: TypeAlias = tuple[Moving, Moving, Moving]
Variables: TypeAlias = tuple[Slope, Slope, Slope, Slope]


class Samples(NamedTuple):
    """Constants of time of the first step at K instants: values and two derivatives, each (K,)."""

    share: list[Ends]  # P12x / s (4)
    lift: list[Ends]  # P12z / H (4)
    shift: list[Ends]  # P6y / n (6)


class Step(NamedTuple):
    """Instants of a step of 1 s."""

    nodes: Samples  # of the rule for the integral (9)
    weights: Ends  # (K,)
    limited: Samples  # at which the reach is limited


def sample(times: list[Any]) -> Samples:
    """Return the constants at instants, which are balls."""
    half, pi, found = arb(1) / 2, arb.pi(), []
    for time in times:
        t = arb_series([time, 1], prec=3)
        share = ((t - half) * pi).sin() * half
        swell = (((t * (pi / 2)).sin() + 1) * (pi / 2)).sin()
        found.append((share, ((share + half) * pi).sin(), swell * (t * pi).sin()))
    return Samples(*([ends([row[k][i] * (1, 1, 2)[i] for row in found]) for i in range(3)] for k in range(3)))


def ends(balls: list[Any]) -> Ends:
    return widen(np.array([float(v.lower()) for v in balls]), np.array([float(v.upper()) for v in balls]))


def make_step(rule: str, intervals: int = 20) -> Step:
    """Return the instants by Simpson's rule, or by Gauss's rule with 16 nodes on each panel of two intervals."""
    panels = intervals // 2
    with ctx.workprec(200):
        if rule == "simpson":
            times = [arb(k) / intervals for k in range(intervals + 1)]
            parts = [1 if k in (0, intervals) else 4 if k % 2 else 2 for k in range(intervals + 1)]
            weights = [arb(part) / (3 * intervals) for part in parts]
        else:  # the judge rounds nodes and weights to 14 digits
            rounded = arb(0, ROUNDED)
            roots = [arb.legendre_p_root(NODES, k, weight=True) for k in range(NODES)]
            times = [(k + (node + rounded + 1) / 2) / panels for k in range(panels) for node, _ in roots]
            weights = [(weight + rounded) / (2 * panels) for _ in range(panels) for _, weight in roots]
        return Step(sample(times), ends(weights), sample([arb(k) / panels for k in range(panels + 1)]))


def move(x: Variables, at: Samples, zero: Slope) -> tuple[Point, Point]:
    """Return the swing ankle (4) and the stance hip (6), both over the stance foot; the ankle's y is that of the hip's foot."""
    s, n, H, h = x
    still = Moving(zero, zero, zero)
    ankle_x, ankle_z = (
        Moving(*(variable * part for part in parts)) for variable, parts in ((s, at.share), (H, at.lift))
    )
    hip_y = Moving(*(n * part for part in at.shift))
    hip_z = still._replace(p=h * number(-1.0) + (number(THIGH) + number(SHANK)))
    return (ankle_x, still, ankle_z), (ankle_x.scaled(number(0.5)), hip_y, hip_z)


def make_variables(boxes: Ends, gradients: bool) -> tuple[Variables, Slope]:
    """Return the variables s, n, H, h and zero, with gradients or with none."""
    unit = np.eye(4)[:, None, :] if gradients else np.empty((0, 1, 4))
    s, n, H, h = (
        Slope(boxes.at(slice(None), slice(i, i + 1)), Ends(unit[..., i : i + 1], unit[..., i : i + 1]))
        for i in range(4)
    )
    none = np.zeros_like(unit[..., :1])
    return (s, n, H, h), Slope(Ends(np.zeros((1, 1)), np.zeros((1, 1))), Ends(none, none))


def evaluate(boxes: Ends, step: Step, weight: float, gradients: bool = True) -> Slope:
    """Return the cost -f (P,) over boxes (P, 4)."""
    x, zero = make_variables(boxes, gradients)
    still, half = Moving(zero, zero, zero), number(0.5)
    swing, hip = move(x, step.nodes, zero)
    moments = [zero, zero]

    def add_mass(mass: float, x: Moving, y: Moving, z: Moving) -> None:
        for axis, place in enumerate((x, y)):
            moment = (z.a + number(GRAVITY)) * place.p - place.a * z.p
            moments[axis] = moments[axis] + moment * number(mass)

    aside = number(WIDTH) * number(-1.0)
    lower, upper = number(SHANK) * number(SHANK), number(THIGH) * number(THIGH)
    difference = (lower - upper) * half
    height = number(SOLE) * reciprocal(number(SHANK))
    legs = ((still, still, still), number(0.0)), (swing, aside)
    for ankle, y_ankle in legs:
        # The knee is off the line from ankle to hip, in front of it (2), (3); `share` and `off` are shares of the line.
        ahead, across_line, above = (to.minus(start) for to, start in zip(hip, ankle, strict=True))
        up_squared = across_line.times(across_line).plus(above.times(above))
        q = ahead.times(ahead).plus(up_squared)
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
        sideways = share.minus(across.times(ahead.times(by_up)))
        knee = share.times(ahead).plus(across.times(up)), sideways.times(across_line), sideways.times(above)
        for mass, part in ((KNEE, number(1.0)), (FOOT, height)):
            place = [base.plus(length.scaled(part)) for base, length in zip(ankle, knee, strict=True)]
            add_mass(mass, place[0], place[1]._replace(p=place[1].p + y_ankle), place[2])
    for mass, shift in ((HIP, number(0.0)), (HIP, aside), (WAIST, aside * half)):
        add_mass(mass, hip[0], hip[1]._replace(p=hip[1].p + shift), hip[2])
    total = number(2.0) * (number(KNEE) + number(FOOT) + number(HIP)) + number(WAIST)
    zmp = [moment * reciprocal(total * number(GRAVITY)) for moment in moments]  # (14)
    Q = sum_last((zmp[0].squared() + zmp[1].squared()) * step.weights)  # (9)
    stability = Q.inverse() * (number(weight) * reciprocal(number(F1_MAX)))  # (10)
    speed = sum_last(x[0]) * ((number(1.0) - number(weight)) * reciprocal(number(F2_MAX)))
    return (stability + speed) * number(-1.0)  # (11)


def evaluate_knees(boxes: Ends, step: Step, gradients: bool = True) -> Slope:
    """Return the cosines of both knees (P, R) over boxes (P, 4)."""
    x, zero = make_variables(boxes, gradients)
    swing, hip = move(x, step.limited, zero)
    links = number(SHANK) * number(SHANK) + number(THIGH) * number(THIGH)
    by_twice = reciprocal(number(2.0) * number(THIGH) * number(SHANK))
    found = []
    for ankle in ((zero, zero, zero), tuple(part.p for part in swing)):
        line = [to.p - start for to, start in zip(hip, ankle, strict=True)]
        q = line[0].squared() + line[1].squared() + line[2].squared()
        found.append((q + links * number(-1.0)) * by_twice)
    value, gradient = (
        Ends(*(np.concatenate([getattr(part, name)[k] for part in found], axis=-1) for k in (0, 1)))
        for name in ("value", "gradient")
    )
    return Slope(value, gradient)


def sum_last(x: Slope) -> Slope:
    """Return the sum over samples."""
    parts = [Slope(x.value.at(..., k), x.gradient.at(..., k)) for k in range(x.value.lo.shape[-1])]
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def prove(step: Step, weight: float, bound: float, *, root: Any = ROOT, at_most: int = 10**9) -> int:
    """Count the boxes left, zero if no x that the judge accepts has f above a bound; stop after so many boxes."""
    both = np.array(root, dtype=float).T[:, None, :]
    left, boxes = Ends(both[0], both[1]), 0
    with np.errstate(all="ignore"):
        while len(left.lo) and boxes < at_most:
            now, rest = left.at(slice(-BATCH, None)), left.at(slice(0, -BATCH))
            boxes += len(now.lo)
            halves = prune(now, step, weight, -bound)
            left = Ends(*(np.concatenate(pair) for pair in zip(rest, halves, strict=True)))
    return len(left.lo)


def prune(boxes: Ends, step: Step, weight: float, target: float) -> Ends:
    """Return what remains of boxes, in halves where little was cut off: first by the reach of the knees, then by the cost."""
    width = boxes.hi - boxes.lo
    limit = float(np.cos(KAPPA)) + 1e-12 + SLACK
    knees, there = (evaluate_knees(box, step, slopes) for box, slopes in ((boxes, True), (middle(boxes), False)))
    boxes, left = contract(boxes, knees, there.value.lo, limit)
    boxes, width = boxes.at(left), width[left]
    cost = evaluate(boxes, step, weight)
    at_middle = evaluate(middle(boxes), step, weight, gradients=False)
    rows = Slope(cost.value.at(..., None), cost.gradient.at(..., None))
    effect = np.maximum(np.abs(cost.gradient.lo), np.abs(cost.gradient.hi)).T
    boxes, left = contract(boxes, rows, at_middle.value.lo[:, None], target)
    lo, hi, width, effect = boxes.lo[left], boxes.hi[left], width[left], effect[left]
    relative = (hi - lo) / np.diff(np.array(ROOT))[:, 0]
    effect = np.where(np.isfinite(effect), effect, 1.0) * (hi - lo)
    shares = effect / effect.sum(axis=1, keepdims=True) + WIDTH_WEIGHT * relative / relative.max(axis=1, keepdims=True)
    again = (hi - lo < SHRUNK * width).any(axis=1)  # these are bounded again as they are
    index = np.arange(np.count_nonzero(~again)), shares[~again].argmax(axis=1)
    left_hi, right_lo = hi[~again], lo[~again]
    left_hi[index] = right_lo[index] = 0.5 * left_hi[index] + 0.5 * right_lo[index]
    return Ends(np.concatenate([lo[again], lo[~again], right_lo]), np.concatenate([hi[again], left_hi, hi[~again]]))


def middle(boxes: Ends) -> Ends:
    point = 0.5 * boxes.lo + 0.5 * boxes.hi
    return Ends(point, point)


def contract(boxes: Ends, rows: Slope, there: Array, limit: float) -> tuple[Ends, Any]:
    """Cut off the slabs of boxes (P, n) in which a row (P, R) is above a limit.

    By the mean-value theorem row(x) >= there + gradient (x - middle), with values ``there`` (P, R) in the middle.

    Returns:
        The boxes, and (P,) whether anything is left of each.
    """
    centre = middle(boxes)
    gradient = Ends(*(part.transpose(1, 2, 0) for part in rows.gradient))
    offset = boxes - centre
    least = (gradient * Ends(offset.lo[:, None, :], offset.hi[:, None, :])).lo
    total = least.sum(axis=-1, keepdims=True)
    slack = 1e-13 * (1.0 + abs(limit) + np.abs(there)[..., None] + np.abs(least).sum(axis=-1, keepdims=True))
    room = (
        (limit - there)[..., None] - (total - least) + slack
    )  # in nearest rounding, whose errors the slack is far above
    known = np.isfinite(room)
    above = np.where(known & (gradient.lo > 0.0), room / np.where(room >= 0.0, gradient.lo, gradient.hi), np.inf)
    below = np.where(known & (gradient.hi < 0.0), room / np.where(room >= 0.0, gradient.hi, gradient.lo), -np.inf)
    far = 1e-15  # above the rounding errors of the sums
    lo = np.maximum(boxes.lo, np.nextafter(centre.lo + below.max(axis=1), -np.inf) - far)
    hi = np.minimum(boxes.hi, np.nextafter(centre.lo + above.min(axis=1), np.inf) + far)
    violated = (rows.value.lo > limit) | (known & (room < least)).any(axis=-1)
    return Ends(lo, hi), ~(violated.any(axis=1) | (lo > hi).any(axis=1))


SEED = 6
LAMBDA = 0.1
BEST = 0.98056  # f at this lambda, rounded up


@pytest.mark.parametrize("rule", ["simpson", "gauss"])
def test_the_printed_formulas_enclose_the_judge(rule: str) -> None:
    problem, step = nlp_gait.load("walk12", quadrature=rule), make_step(rule)
    low, high = np.array(ROOT).T
    X = np.random.default_rng(SEED).uniform(low, high, (8, 4))
    X[0] = load_facts()["walk12-w015"].best_x
    costs, knees = evaluate(Ends(X, X), step, 0.15, gradients=False), evaluate_knees(Ends(X, X), step, gradients=False)
    model, compared = build_exact_model(problem), 0
    for x, lo, hi, reach in zip(X, costs.value.lo, costs.value.hi, knees.value.lo, strict=True):
        at = model.at(x, problem.p)
        assert np.allclose(np.sort(reach), np.sort(at.g[:22]), rtol=0.0, atol=1e-13)
        if at.violation == 0.0:
            compared += 1
            assert lo - 1e-13 <= at.cost <= hi + 1e-13 and hi - lo < 1e-12
    assert compared >= 5


@pytest.mark.slow
def test_a_true_bound_is_proven_and_a_false_one_is_not() -> None:
    step = make_step("simpson")
    assert prove(step, LAMBDA, 1.4 * BEST) == 0
    around = [(0.12, 0.13), (0.11, 0.117), (0.001, 0.004), (0.009, 0.012)]
    assert prove(step, LAMBDA, 0.999 * BEST, root=around, at_most=200) > 0
