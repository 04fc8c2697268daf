"""Printed points: what is true of all x that round to the printed digits.

Every component lies within half a unit of its last printed digit. The box of these points is split, its parts are enclosed by
affine forms, and points of each are evaluated.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from decimal import Decimal, InvalidOperation
from typing import Any, Literal, NamedTuple

import numpy as np

from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.backends.kernel.kernel_source import build_kernel
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs.affine import AffineForms, AffineFunction
from nlp_gait.proofs.boxes import Numbers, halve

BOXES = 64  # parts of the box, at most
COST_SHARE = 0.05  # a part is split while its cost may exceed what was found by this share of the range found
SAMPLES = 100  # random points and corners
FEW_DIGITS = 10  # of a printed number; more are exact for all that is judged

Where = Literal["everywhere", "somewhere", "nowhere"]
How = Literal["enclosed", "evaluated", "sampled"]


@dataclass(frozen=True, kw_only=True)
class TightestConstraint:
    """The constraint that is violated most at a point, relative to its scale, or else satisfied most narrowly."""

    constraint: str
    violation: float  #: [unit]; negative: how far it is from its bound
    unit: str

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        if self.violation > 0.0:
            return f"{self.constraint} is violated by {self.violation:.3g}{unit}"
        return f"{self.constraint} is satisfied with {-self.violation:.3g}{unit} to spare"


@dataclass(frozen=True, kw_only=True)
class Rounded:
    """A problem over all points that round to the printed digits."""

    problem: str
    x: Mapping[str, str]  #: as printed, by variable name
    box: Mapping[str, tuple[float, float]]  #: possible values, within the bounds of the variables
    objective: Mapping[str, Any]  #: name and unit
    best: float  #: best objective that was found in the box; feasible or not
    worst: float  #: worst one
    enclosure: tuple[float, float] | None  #: contains the objective of every point; None if it cannot be enclosed
    feasible: Where  #: whether the points are feasible at the problem's samples
    how: How  #: proven by enclosures, by a feasible and an infeasible point, or true of all evaluated points
    at_best: TightestConstraint  #: at the point with the least of the largest violations
    at_worst: TightestConstraint  #: at the point with the largest violation
    #: whether some point has the claimed objective, to its digits; None without a claim
    claim: Literal["reached", "not found", "impossible"] | None

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {"schema": 1, **asdict(self)}


class _Point(NamedTuple):
    values: ExactValues
    excess: Array  # (r,) signed violations, divided by their scales


def evaluate_rounded(problem: GaitProblem, printed: Sequence[str], claimed: str | None = None) -> Rounded:
    """Judge all points (n,) that round to printed numbers, and a claimed objective as it was printed.

    Raises InputError for texts that are not finite numbers.
    """
    if len(printed) != len(problem.names):
        raise InputError(
            f"{problem.name} has {len(problem.names)} variables: {', '.join(problem.names)}; got {len(printed)}"
        )
    box = np.array([_read_interval(name, text) for name, text in zip(problem.names, printed, strict=True)])
    clipped = np.stack([np.maximum(box[:, 0], problem.lower), np.minimum(box[:, 1], problem.upper)], axis=-1)
    outside = clipped[:, 0] > clipped[:, 1]
    box = np.where(outside[:, None], box, clipped)
    # A variable's bounds are satisfied in the whole box, or in none of it; they matter then, or without other constraints.
    model = build_exact_model(problem)
    count = len(model.row_names) - len(box)
    rows = np.append(np.arange(count), count + (np.flatnonzero(outside) if count else np.arange(len(box))))
    points, parts = _search(problem, box, rows)

    def describe(point: _Point) -> TightestConstraint:
        k = int(np.argmax(point.excess))
        violation = float(point.excess[k] * model.row_scales[rows[k]])
        return TightestConstraint(
            constraint=model.row_names[rows[k]], violation=violation, unit=model.row_units[rows[k]]
        )

    costs = [point.values.cost for point in points if math.isfinite(point.values.cost)] or [math.nan]
    sign = problem.objective.sign
    best, worst = sign * min(costs), sign * max(costs)
    enclosure = None if parts is None else sorted((sign * parts[0, :, 0].min(), sign * parts[1, :, 0].max()))
    if enclosure is not None and not np.isfinite(enclosure).all():
        enclosure = None
    feasible, how = _decide(points, parts)
    claim: Literal["reached", "not found", "impossible"] | None = None
    if claimed is not None:
        low, high = _read_interval("the claimed objective", claimed)
        claim = "reached" if low <= max(best, worst) and high >= min(best, worst) else "not found"
        if enclosure is not None and (high < enclosure[0] or low > enclosure[1]):
            claim = "impossible"
    return Rounded(
        problem=problem.address,
        x=dict(zip(problem.names, printed, strict=True)),
        box={name: (float(low), float(high)) for name, (low, high) in zip(problem.names, box, strict=True)},
        objective={"name": problem.objective.name, "unit": problem.objective.unit},
        best=best,
        worst=worst,
        enclosure=None if enclosure is None else (float(enclosure[0]), float(enclosure[1])),
        feasible=feasible,
        how=how,
        at_best=describe(min(points, key=lambda point: point.excess.max())),
        at_worst=describe(max(points, key=lambda point: point.excess.max())),
        claim=claim,
    )


def find_feasible(problem: GaitProblem, printed: Sequence[str]) -> Array | None:
    """Return the point (n,) nearest to the printed one that rounds to it and is feasible; None if no point that is tried is.

    All numbers have as many significant digits as the longest one: programs leave zeros at the end out. Points with more than
    ``FEW_DIGITS`` digits stand for themselves.
    """
    x, model = np.array([float(text) for text in printed]), build_exact_model(problem)
    digits = max(len(Decimal(text.strip()).as_tuple().digits) for text in printed)
    if digits > FEW_DIGITS:
        return None
    half = 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(np.abs(x), np.finfo(float).tiny))) + 1 - digits)
    box = np.stack([x - half, x + half], axis=-1)
    rng = np.random.default_rng(0)
    places = np.concatenate([rng.uniform(size=(SAMPLES, len(x))), rng.integers(2, size=(SAMPLES, len(x)))])
    points = np.clip(box[:, 0] + places * np.diff(box)[:, 0], problem.lower, problem.upper)
    distances = np.abs((points - x) / np.diff(box)[:, 0]).max(axis=1)
    for point in points[np.argsort(distances)]:
        if ((box[:, 0] <= point) & (point <= box[:, 1])).all() and model.at(point, problem.p).feasible:
            return point
    return None


def _read_interval(name: str, text: str) -> tuple[float, float]:
    """Return the ends of the interval of all numbers that round to a text."""
    try:
        value = Decimal(text.strip())
    except InvalidOperation:
        value = Decimal("NaN")
    exponent = value.as_tuple().exponent
    if not isinstance(exponent, int) or not math.isfinite(float(value)):
        raise InputError(f"{name} must be a finite number as it was printed, got {text!r}")
    half = Decimal(5).scaleb(exponent - 1)
    return math.nextafter(float(value - half), -math.inf), math.nextafter(float(value + half), math.inf)


def _search(problem: GaitProblem, box: Array, rows: Numbers) -> tuple[list[_Point], Array | None]:
    """Evaluate points of the box, and enclose its parts; None without a compiler, or for an operation without enclosure.

    The enclosures (2, P, 1 + r) are bounds of cost and signed violations, divided by their scales; infinite where unknown.
    """
    model, points = build_exact_model(problem), list[_Point]()
    scales = model.row_scales[rows]

    def evaluate(x: Array) -> None:
        values = model.at(np.clip(x, box[:, 0], box[:, 1]), problem.p)
        excess = np.maximum(values.lower - values.g, values.g - values.upper)[rows] / scales
        points.append(_Point(values, np.where(np.isnan(excess), np.inf, excess)))

    rng, edges = np.random.default_rng(0), np.diff(box)[:, 0]
    for place in (*rng.uniform(size=(SAMPLES, len(box))), *rng.integers(2, size=(SAMPLES, len(box)))):
        evaluate(box[:, 0] + place * edges)
    try:
        function = problem.build_once(_build_enclosure)
    except (InputError, CompilerError):
        return points, None
    low, high = (bound[rows] for bound in build_kernel(problem).row_bounds(problem))
    fixed, symbols = np.stack([problem.p] * 2, axis=-1), np.append(np.arange(len(box)), [-1] * len(problem.p))
    boxes, done = box[None], list[Array]()
    while True:
        given = np.concatenate([boxes, np.broadcast_to(fixed, (len(boxes), *fixed.shape))], axis=1)
        forms: AffineForms = function(given, symbols)
        columns = np.append(0, 1 + rows)
        least, most, slopes = forms.lower[:, columns], forms.upper[:, columns], forms.slopes[:, columns]
        lower = np.hstack([least[:, :1], np.maximum(least[:, 1:] - high, low - most[:, 1:]) / scales])
        upper = np.hstack([most[:, :1], np.maximum(most[:, 1:] - high, low - least[:, 1:]) / scales])
        lower, upper = parts = np.stack([np.nan_to_num(lower, nan=-np.inf), np.nan_to_num(upper, nan=np.inf)])
        worst = 1 + upper[:, 1:].argmax(axis=1)
        for k, (centre, half) in enumerate(zip(boxes.mean(axis=2), np.diff(boxes)[..., 0] / 2, strict=True)):
            for direction in (np.sign(slopes[k, 0]), np.sign(slopes[k, worst[k]])):
                evaluate(centre + half * direction)
                evaluate(centre - half * direction)
        costs = [point.values.cost for point in points if math.isfinite(point.values.cost)] or [math.nan]
        gap = COST_SHARE * (max(costs) - min(costs))
        unsure = (lower[:, 0] < min(costs) - gap) | (upper[:, 0] > max(costs) + gap)
        if _decide(points, None)[1] == "sampled":
            unsure |= _is_feasible(lower) & ~_is_feasible(upper)
        whole = np.concatenate([*done, parts], axis=1)
        if not unsure.any() or whole.shape[1] + unsure.sum() > BOXES:
            return points, whole
        done.append(parts[:, ~unsure])
        effects = np.abs(slopes) / np.append(gap or 1.0, scales)[:, None]
        boxes = halve(boxes[unsure], np.nan_to_num(effects[unsure]).max(axis=1).argmax(axis=-1))


def _build_enclosure(problem: GaitProblem) -> AffineFunction:
    return AffineFunction(build_kernel(problem).function)


def _is_feasible(excess: Array) -> Any:
    return np.maximum(excess[:, 1:], 0.0).sum(axis=1) <= FEASIBILITY_TOLERANCE


def _decide(points: Sequence[_Point], parts: Array | None) -> tuple[Where, How]:
    """Return whether the points are feasible, and how that is known."""
    good = [point.values.violation <= FEASIBILITY_TOLERANCE for point in points]
    if any(good) and not all(good):
        return "somewhere", "evaluated"
    if parts is not None and all(good) and _is_feasible(parts[1]).all():
        return "everywhere", "enclosed"
    if parts is not None and not any(good) and not _is_feasible(parts[0]).any():
        return "nowhere", "enclosed"
    return ("everywhere" if all(good) else "nowhere"), "sampled"
