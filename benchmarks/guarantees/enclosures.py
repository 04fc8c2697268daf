"""Soundness of affine arithmetic against an independent library of tight intervals.

``python -m benchmarks.guarantees.enclosures [COUNT]``. Every operation is enclosed over random boxes, some of them points, some
tiny, some wide; at random points of each the exact
value, known from `crival` (IEEE 1788.1) to the two doubles around it, must lie within the range and, in exact rational
arithmetic, within the affine form.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import casadi as ca
import ival
import numpy as np

from nlp_gait.proofs.affine import AffineFunction, Forms
from nlp_gait.proofs.quadratic import QuadraticForms, QuadraticFunction

COUNT = 100_000
SEED = 19
Array = np.ndarray[Any, np.dtype[np.float64]]

# Operation, the same of tight intervals, and the range of its arguments.
OPERATIONS: dict[str, tuple[Callable[..., Any], Callable[..., Any], tuple[float, float]]] = {
    "add": (lambda x, y: x + y, lambda x, y: x + y, (-1e3, 1e3)),
    "sub": (lambda x, y: x - y, lambda x, y: x - y, (-1e3, 1e3)),
    "mul": (lambda x, y: x * y, lambda x, y: x * y, (-1e3, 1e3)),
    "div": (lambda x, y: x / y, lambda x, y: x / y, (0.01, 1e3)),
    "divided by a negative": (lambda x, y: x / (-y), lambda x, y: x / -y, (0.01, 1e3)),
    "tiny product": (lambda x, y: x * 1e-200 * (y * 1e-200) * 1e300, lambda x, y: tiny(x, y), (-1.0, 1.0)),
    "sq": (lambda x, y: x**2, lambda x, y: ival.sqr(x), (-1e3, 1e3)),
    "cube": (lambda x, y: x**3, lambda x, y: ival.pown(x, 3), (-10.0, 10.0)),
    "sqrt": (lambda x, y: ca.sqrt(x), lambda x, y: ival.sqrt(x), (0.0, 1e3)),
    "sin": (lambda x, y: ca.sin(x), lambda x, y: ival.sin(x), (-10.0, 10.0)),
    "cos": (lambda x, y: ca.cos(x), lambda x, y: ival.cos(x), (-10.0, 10.0)),
    "tan": (lambda x, y: ca.tan(x), lambda x, y: ival.tan(x), (-1.5, 1.5)),
    "asin": (lambda x, y: ca.asin(x), lambda x, y: ival.asin(x), (-1.0, 1.0)),
    "acos": (lambda x, y: ca.acos(x), lambda x, y: ival.acos(x), (-1.0, 1.0)),
    "atan": (lambda x, y: ca.atan(x), lambda x, y: ival.atan(x), (-20.0, 20.0)),
    "atan2": (lambda x, y: ca.atan2(x, y), lambda x, y: ival.atan2(x, y), (-5.0, 5.0)),
    "exp": (lambda x, y: ca.exp(x), lambda x, y: ival.exp(x), (-20.0, 20.0)),
    "log": (lambda x, y: ca.log(x), lambda x, y: ival.log(x), (1e-3, 1e3)),
    "tanh": (lambda x, y: ca.tanh(x), lambda x, y: ival.tanh(x), (-5.0, 5.0)),
    "sinh": (lambda x, y: ca.sinh(x), lambda x, y: ival.sinh(x), (-5.0, 5.0)),
    "cosh": (lambda x, y: ca.cosh(x), lambda x, y: ival.cosh(x), (-5.0, 5.0)),
    "fabs": (lambda x, y: ca.fabs(x), lambda x, y: abs(x), (-1.0, 1.0)),
    "fmin": (lambda x, y: ca.fmin(x, y), lambda x, y: ival.min(x, y), (-1.0, 1.0)),
    "fmax": (lambda x, y: ca.fmax(x, y), lambda x, y: ival.max(x, y), (-1.0, 1.0)),
    "floor": (lambda x, y: ca.floor(x), lambda x, y: ival.floor(x), (-5.0, 5.0)),
    "ceil": (lambda x, y: ca.ceil(x), lambda x, y: ival.ceil(x), (-5.0, 5.0)),
    "sign": (lambda x, y: ca.sign(x), lambda x, y: ival.sign(x), (-1.0, 1.0)),
    "fmod": (lambda x, y: ca.fmod(x, 0.7), lambda x, y: remainder(x), (-5.0, 5.0)),
    "if_else_zero": (lambda x, y: ca.if_else(x >= 0, y, 0), lambda x, y: y if x.inf >= 0 else 0 * y, (-1.0, 1.0)),
    "composed": (
        lambda x, y: ca.sin(x * y) / (1.5 + ca.cos(x) * y) - ca.sqrt(x * x + 1) * (x - y),
        lambda x, y: ival.sin(x * y) / (1.5 + ival.cos(x) * y) - ival.sqrt(x * x + 1) * (x - y),
        (-1.0, 1.0),
    ),
}


# The same of what has a form of degree two: only points at which the smaller one of x and 0.5 is x are of interest.
_SHARED = ("add", "sub", "mul", "div", "divided by a negative", "tiny product", "sq", "sqrt", "fabs")
QUADRATIC: dict[str, tuple[Callable[..., Any], Callable[..., Any], tuple[float, float]]] = {
    **{name: OPERATIONS[name] for name in _SHARED},
    "larger than a number": (lambda x, y: ca.fmax(x, 0.1), lambda x, y: ival.max(x, ival.Interval(0.1)), (-1.0, 1.0)),
    "at most a number": (lambda x, y: ca.fmin(x, 2.0) * y, lambda x, y: x * y, (-1.0, 1.0)),
    "only below a number": (
        lambda x, y: ca.if_else(x < 0.1, y, 0),
        lambda x, y: y if x.sup < 0.1 else 0 * y,
        (-1.0, 1.0),
    ),
    "composed": (
        lambda x, y: x * y / (1.5 + x * y * y) - ca.sqrt(x * x + 1) * (x - y) * y,
        lambda x, y: x * y / (1.5 + x * y * y) - ival.sqrt(x * x + 1) * (x - y) * y,
        (-1.0, 1.0),
    ),
    "composed of squares": (
        lambda x, y: (x - y) ** 2 - x**2 + 2 * x * y - y**2 + 1 / (2 + x),
        lambda x, y: 1 / (2 + x),
        (-1.0, 1.0),
    ),
}


def tiny(x: Any, y: Any) -> Any:
    """Product that underflows on the way, in exact arithmetic."""
    exact = Fraction(x.inf) * Fraction(1e-200) * Fraction(y.inf) * Fraction(1e-200) * Fraction(1e300)
    return ival.Interval(exact)


def remainder(x: Any) -> Any:
    """Remainder of a division by the double nearest to 0.7, in exact arithmetic, with the sign of x."""
    exact, part = Fraction(x.inf), Fraction(0.7)
    turns = abs(exact) // part
    return ival.Interval(exact - (1 if exact > 0 else -1) * turns * part)


def random_boxes(range_: tuple[float, float], count: int, rng: np.random.Generator) -> Array:
    """(count, 2, 2) boxes of two arguments within a range, of widths from none to all of it."""
    low, high = range_
    middle = rng.uniform(low, high, (count, 2))
    half = (high - low) * 10.0 ** rng.uniform(-17, 0.3, (count, 1)) * rng.uniform(0.1, 1.0, (count, 2))
    half[rng.random((count, 2)) < 0.1] = 0.0
    middle[rng.random((count, 2)) < 0.02] = low
    return np.stack([np.clip(middle - half, low, high), np.clip(middle + half, low, high)], -1)


def lost(name: str, count: int, rng: np.random.Generator, *, quadratic: bool = False) -> list[str]:
    """Random points of random boxes whose exact value an enclosure of an operation does not hold, in words."""
    operation, tight, range_ = (QUADRATIC if quadratic else OPERATIONS)[name]
    x = ca.SX.sym("x", 2)
    expression = ca.Function("operation", [x], [ca.SX(operation(x[0], x[1]))])
    boxes = random_boxes(range_, count, rng)
    forms: Forms | QuadraticForms
    forms = QuadraticFunction(expression)(boxes) if quadratic else AffineFunction(expression)(boxes, np.arange(2))
    found = []
    for k, box in enumerate(boxes):
        point = np.clip(rng.uniform(box[:, 0], box[:, 1]), box[:, 0], box[:, 1])
        if rng.random() < 0.2:
            point = box[np.arange(2), rng.integers(0, 2, 2)]
        value = tight(*(ival.Interval(float(v)) for v in point))
        if np.isnan(value.inf):
            continue
        # The exact value lies between two neighbouring doubles: a bound holds it if it holds the one beyond it. What is
        # composed has bounds that are not tight, and must only meet.
        ends = (value.sup, value.inf) if name.startswith("composed") else (value.inf, value.sup)
        if not (forms.lower[k, 0] <= ends[0] and ends[1] <= forms.upper[k, 0] and in_form(forms, k, box, point, ends)):
            found.append(f"{name} at {point.tolist()} of {box.tolist()}: {value}")
    return found


def in_form(forms: Forms | QuadraticForms, k: int, box: Array, point: Array, ends: tuple[float, float]) -> bool:
    """Whether both ends lie within a form at a point of its box, in exact arithmetic."""
    if not np.isfinite(forms.error[k, 0]):
        return True
    half_width = quadratic_reach if isinstance(forms, QuadraticForms) else reach
    e = []
    for (low, high), at in zip(box.tolist(), point.tolist(), strict=True):
        centre = 0.5 * low + 0.5 * high
        half = half_width(low, high, centre)
        e.append((Fraction(at) - Fraction(centre)) / Fraction(half) if half else Fraction(0))
    value = Fraction(float(forms.middle[k, 0]))
    value += sum(Fraction(slope) * at for slope, at in zip(forms.slopes[k, 0].tolist(), e, strict=True))
    if isinstance(forms, QuadraticForms):
        pairs = [e[i] * e[j] for j in range(len(e)) for i in range(j + 1)]
        value += sum(Fraction(bend) * pair for bend, pair in zip(forms.bends[k, 0].tolist(), pairs, strict=True))
    error = Fraction(float(forms.error[k, 0]))
    return value - error <= Fraction(ends[0]) and Fraction(ends[1]) <= value + error


def reach(low: float, high: float, centre: float) -> float:
    """What the library takes for half the width of a box: no less than it is."""
    if low == high:
        return 0.0
    ends = (high - centre, centre - low)
    for _ in range(2):  # rounded up twice, as ``reach`` in native/affine.hpp does
        ends = tuple(v + (2.0**-52 * abs(v) + 2.0**-1074) for v in (max(ends), max(ends)))
    return float(ends[0])


def quadratic_reach(low: float, high: float, centre: float) -> float:
    """The same of forms of degree two, as ``reach`` in native/quadratic.hpp has it."""
    far = max(high - centre, centre - low)
    return far + (2.0**-51 * abs(far) + 1e-290)


def main() -> None:
    """Check all operations."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    rng = np.random.default_rng(SEED)
    for quadratic, operations in ((False, OPERATIONS), (True, QUADRATIC)):
        each = -(-count // len(operations))
        total = 0
        for name in operations:
            missing = lost(name, each, rng, quadratic=quadratic)
            total += len(missing)
            for text in missing[:3]:
                print(text)
        kind = "forms of degree two" if quadratic else "affine forms"
        print(
            f"{kind}: {each * len(operations):,} points of random boxes over {len(operations)} operations, {total} lost"
        )


if __name__ == "__main__":
    main()
