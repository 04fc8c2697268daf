"""Printed points: what holds for all x that round to the printed digits.

Every component lies within half a unit of its last printed digit. Objective and constraints are enclosed over this box by affine
forms where their operations allow it; best and worst points are found by a search in both cases.
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
from nlp_gait.proofs.affine import AffineFunction
from nlp_gait.proofs.boxes import Numbers

# Linear models in turn, each at the point that the last one found.
ROUNDS = 4
# Distance of the points of a finite difference, as a share of half the box.
STEP = 0.5
# Steps towards the best point of a linear model, which may end before it where the functions have kinks.
SHARES = (1.0, 0.25, 0.05)
RANDOM_POINTS = 50
# Constraints that are violated most in the linear model, whose worst points are evaluated.
MOST_ROWS = 5
# Widens sums of affine forms: far more than their rounding errors.
WIDENING = 1e-12

Where = Literal["everywhere", "somewhere", "nowhere"]
How = Literal["enclosed", "found by optimisation", "evaluated"]


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
    how: How  #: the verdict is enclosed, found by optimisation, or evaluated at a feasible and an infeasible point
    at_best: TightestConstraint  #: at the point with the least of the largest violations
    at_worst: TightestConstraint  #: at the point with the largest violation

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {"schema": 1, **asdict(self)}


class _Forms(NamedTuple):
    """Values over the box: middle + slopes e, to within the error, for e in [-1, 1]^n; the cost, then signed violations."""

    middle: Array  # (1 + r,)
    slopes: Array  # (1 + r, n)
    error: Array  # (1 + r,)


class _Point(NamedTuple):
    x: Array
    values: ExactValues
    excess: Array  # (r,) signed violations, divided by their scales


def evaluate_rounded(problem: GaitProblem, printed: Sequence[str]) -> Rounded:
    """Judge all points (n,) that round to printed numbers; raises InputError for texts that are no finite numbers."""
    box, outside = _make_box(problem, printed)
    judged = _Judge(problem, box, outside)
    judged.search()
    best, worst = min(judged.points, key=_find_largest), max(judged.points, key=_find_largest)
    costs = [point.values.cost for point in judged.points if math.isfinite(point.values.cost)] or [math.nan]
    sign, enclosed = problem.objective.sign, judged.enclose()
    feasible, how = judged.decide(enclosed)
    ends = None if enclosed is None else sorted(float(sign * end[0]) for end in _bound(enclosed))
    return Rounded(
        problem=problem.address,
        x=dict(zip(problem.names, printed, strict=True)),
        box={name: (float(low), float(high)) for name, (low, high) in zip(problem.names, box, strict=True)},
        objective={"name": problem.objective.name, "unit": problem.objective.unit},
        best=sign * min(costs),
        worst=sign * max(costs),
        enclosure=None if ends is None else (ends[0], ends[1]),
        feasible=feasible,
        how=how,
        at_best=judged.describe(best),
        at_worst=judged.describe(worst),
    )


def _make_box(problem: GaitProblem, printed: Sequence[str]) -> tuple[Array, Numbers]:
    """Return the box (n, 2) within the bounds, and the variables whose intervals lie outside theirs."""
    if len(printed) != len(problem.names):
        raise InputError(
            f"{problem.name} has {len(problem.names)} variables: {', '.join(problem.names)}; got {len(printed)}"
        )
    box = np.empty((len(printed), 2))
    for k, text in enumerate(printed):
        try:
            value = Decimal(text.strip())
        except InvalidOperation:
            value = Decimal("NaN")
        exponent = value.as_tuple().exponent
        if not isinstance(exponent, int) or not math.isfinite(float(value)):
            raise InputError(f"{problem.names[k]} must be a finite number as it was printed, got {text!r}")
        half = Decimal(5).scaleb(exponent - 1)
        box[k] = np.nextafter(float(value - half), -np.inf), np.nextafter(float(value + half), np.inf)
    low, high = np.maximum(box[:, 0], problem.lower), np.minimum(box[:, 1], problem.upper)
    outside = low > high
    box[~outside] = np.stack([low, high], axis=-1)[~outside]
    return box, np.flatnonzero(outside)


class _Judge:
    """Points of the box and what the exact functions are there."""

    def __init__(self, problem: GaitProblem, box: Array, outside: Numbers) -> None:
        self.problem, self.box, self.model = problem, box, build_exact_model(problem)
        self.centre, self.half = box.mean(axis=1), np.diff(box)[:, 0] / 2
        rows = len(self.model.row_names) - len(problem.names)
        # A variable's bounds are satisfied in the whole box, or in none of it; they matter then, or without other constraints.
        self.rows = np.concatenate([np.arange(rows), rows + (outside if rows else np.arange(len(box)))])
        self.scales = self.model.row_scales[self.rows]
        self.points: list[_Point] = []

    def evaluate(self, x: Array) -> _Point:
        x = np.clip(x, self.box[:, 0], self.box[:, 1])
        values = self.model.at(x, self.problem.p)
        violation = np.maximum(values.lower - values.g, values.g - values.upper)[self.rows]
        point = _Point(x, values, np.where(np.isnan(violation), np.inf, violation) / self.scales)
        self.points.append(point)
        return point

    def search(self) -> None:
        """Look for the best and worst objective and largest violation, at random points and by linear models in turn."""
        for place in np.random.default_rng(0).uniform(-1.0, 1.0, (RANDOM_POINTS, len(self.half))):
            self.evaluate(self.centre + self.half * place)
        starts, models = [self.evaluate(self.centre)] * 4, dict[int, _Forms]()
        for _ in range(ROUNDS):
            models |= {id(start): self._linearise(start) for start in starts if id(start) not in models}
            cheap, costly, good, bad = (models[id(start)] for start in starts)
            predicted = bad.middle[1:] + np.abs(bad.slopes[1:]).sum(axis=1)
            worst = [np.sign(bad.slopes[1 + k]) for k in np.argsort(-predicted)[:MOST_ROWS]]
            corners = (-np.sign(cheap.slopes[0]), np.sign(costly.slopes[0]), _solve_linear(good)[0], *worst)
            for origin, corner in zip([*starts, *starts[3:] * MOST_ROWS], corners, strict=False):
                for share in SHARES:
                    self.evaluate(origin.x + share * (self.centre + self.half * corner - origin.x))
            known = [point for point in self.points if math.isfinite(point.values.cost)] or self.points
            found = [
                choose(known, key=key) for key in (lambda p: p.values.cost, _find_largest) for choose in (min, max)
            ]
            if all(a is b for a, b in zip(found, starts, strict=True)):
                return
            starts = found

    def _linearise(self, at: _Point) -> _Forms:
        """Return the linear model by central differences about a point, in units of half the box from its centre."""
        base = np.concatenate([[at.values.cost], at.excess])
        slopes = np.zeros((len(base), len(self.half)))
        for j in np.flatnonzero(self.half):
            step = np.zeros(len(self.half))
            step[j] = STEP * self.half[j]
            ahead, behind = self.evaluate(at.x + step), self.evaluate(at.x - step)
            change = np.concatenate([[ahead.values.cost - behind.values.cost], ahead.excess - behind.excess])
            slopes[:, j] = np.nan_to_num(change * self.half[j] / (ahead.x[j] - behind.x[j]), posinf=0.0, neginf=0.0)
        place = np.divide(at.x - self.centre, self.half, out=np.zeros(len(self.half)), where=self.half > 0.0)
        return _Forms(np.nan_to_num(base, posinf=1e9) - slopes @ place, slopes, np.zeros(len(base)))

    def enclose(self) -> _Forms | None:
        """Return rigorous forms; None without a compiler, or if an operation or a value cannot be enclosed."""
        kernel, n = build_kernel(self.problem), len(self.half)
        given = np.concatenate([self.box, np.stack([self.problem.p] * 2, axis=-1)])
        try:
            enclose = self.problem.build_once(_build_enclosure)
            found = enclose(given[None], np.concatenate([np.arange(n), np.full(len(self.problem.p), -1)]))
        except (InputError, CompilerError):
            return None
        lower, upper = (bound[self.rows] for bound in kernel.row_bounds(self.problem))
        rows = 1 + self.rows
        middle, slopes, error = found.middle[0], found.slopes[0], found.error[0]
        one_sided = np.concatenate([middle[rows] - upper, lower - middle[rows]])
        errors = np.tile(error[rows] + WIDENING * np.abs(middle[rows]), 2)
        bounded, scales = np.isfinite(np.concatenate([upper, lower])), np.tile(self.scales, 2)
        forms = _Forms(
            np.append(middle[0], (one_sided / scales)[bounded]),
            np.vstack([slopes[0], (np.concatenate([slopes[rows], -slopes[rows]]) / scales[:, None])[bounded]]),
            np.append(error[0], (errors / scales)[bounded]),
        )
        return forms if all(np.isfinite(part).all() for part in forms) else None

    def decide(self, enclosed: _Forms | None) -> tuple[Where, How]:
        """Return whether the points are feasible, and how that is known."""
        good = [point.values.violation <= FEASIBILITY_TOLERANCE for point in self.points]
        if any(good) and not all(good):
            return "somewhere", "evaluated"
        if enclosed is not None:
            if np.maximum(_bound(enclosed)[1][1:], 0.0).sum() <= FEASIBILITY_TOLERANCE:
                return "everywhere", "enclosed"
            if not any(good) and _solve_linear(enclosed)[1] > FEASIBILITY_TOLERANCE:
                return "nowhere", "enclosed"
        return ("everywhere" if any(good) else "nowhere"), "found by optimisation"

    def describe(self, point: _Point) -> TightestConstraint:
        """Return the largest violation at a point."""
        k = int(np.argmax(point.excess))
        row = int(self.rows[k])
        return TightestConstraint(
            constraint=self.model.row_names[row],
            violation=float(point.excess[k] * self.scales[k]),
            unit=self.model.row_units[row],
        )


def _build_enclosure(problem: GaitProblem) -> AffineFunction:
    return AffineFunction(build_kernel(problem).function)


def _find_largest(point: _Point) -> float:
    return float(point.excess.max(initial=-np.inf))


def _bound(forms: _Forms) -> tuple[Array, Array]:
    """Return lower and upper bounds of all values."""
    size = np.abs(forms.slopes).sum(axis=1) + forms.error
    size += WIDENING * (np.abs(forms.middle) + size)
    return forms.middle - size, forms.middle + size


def _solve_linear(forms: _Forms) -> tuple[Array, float]:
    """Return e with the least of the largest violations of the forms, and a lower bound of it over the box.

    Every convex combination of violations is a lower bound of the largest one; the multipliers of the linear program give the
    best combination, whatever their rounding errors.
    """
    from scipy.optimize import linprog

    middle, slopes, error = (part[1:] for part in forms)
    r, n = slopes.shape
    found = linprog(
        np.append(np.zeros(n), 1.0),
        A_ub=np.column_stack([slopes, -np.ones(r)]),
        b_ub=error - middle,
        bounds=[*[(-1.0, 1.0)] * n, (None, None)],
    )
    if found.status != 0:
        return np.zeros(n), -math.inf
    weights = np.maximum(-found.ineqlin.marginals, 0.0)
    weights /= weights.sum() * (1.0 + WIDENING)  # their sum is 1, but for rounding
    bound = float(weights @ (middle - error) - np.abs(weights @ slopes).sum())
    return found.x[:n], bound - WIDENING * (1.0 + float(np.abs(weights) @ np.abs(middle)))
