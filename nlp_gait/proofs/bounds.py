"""Bounds of a problem's cost over boxes, and the part of a box in which a better feasible point may lie.

``AffineBounds`` read the exact functions of any problem; ``PowerBounds`` read the least-power form of NAO's phases, and are far
narrower.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaits.nao.problems import LeastPower
from nlp_gait.proofs.affine import AffineForms, AffineFunction, Flags, Numbers, Remaining
from nlp_gait.proofs.nao.phases import make_power_form
from nlp_gait.proofs.quadratic import QuadraticFunction
from nlp_gait.proofs.quadratic_tape import AGREEMENT, WIDENING, PowerForm

# A box is enclosed again if an edge shrinks by this share, in so many rounds at most.
LEAST_SHRINKAGE = 0.1
ROUNDS = 4
# Widens the few sums taken here, in NumPy: far more than their rounding errors.
ROUNDING = 1e-12
# Weight of an edge's width relative to its effect on cost and rows, for the choice of the cut.
WIDTH_WEIGHT = 0.3
# Points at which a least-power form is compared with the exact functions.
POINTS, TRIES, SEED = 10, 10_000, 5


class Bounds(ABC):
    """Bounds over boxes of z, which are the points x in some coordinates."""

    root: Array  # (1, n, 2) box that contains the z of all x within their bounds

    def to_z(self, x: Array) -> Array:
        """Return the z (P, n) of points (P, n)."""
        return x

    def prune(self, boxes: Array, target: float) -> Remaining:
        """Remove from boxes (P, n, 2), each independently of the others, all that has no feasible point below the target."""
        groups = np.array_split(np.arange(len(boxes)), max(1, min(available_cores(), len(boxes) // 64)))
        if len(groups) == 1:
            return self._prune(boxes, target)
        with ThreadPoolExecutor(len(groups)) as threads:
            results = list(threads.map(lambda group: self._prune(boxes[group], target), groups))
        whole = Remaining(*(np.concatenate(columns) for columns in zip(*results, strict=True)))
        return whole._replace(
            origin=np.concatenate([group[f.origin] for group, f in zip(groups, results, strict=True)])
        )

    @abstractmethod
    def _prune(self, boxes: Array, target: float) -> Remaining: ...


def make_bounds(problem: GaitProblem) -> Bounds:
    """Return the narrowest bounds that a problem has.

    Raises:
        InputError: an operation that cannot be enclosed, or a least-power form that differs from the exact functions.
        CompilerError: there is no compiler, or it fails.
    """
    return PowerBounds(problem) if has_power_form(problem) else AffineBounds(problem)


def has_power_form(problem: GaitProblem) -> bool:
    """Return whether a problem has a least-power form; user code may have changed the problem, but not the form."""
    return isinstance(problem.least_power, LeastPower) and not problem.loaded_as


class AffineBounds(Bounds):
    """Affine bounds of a problem's exact functions over boxes of its variables."""

    def __init__(self, problem: GaitProblem) -> None:
        model = build_exact_model(problem)
        n, self._rows = len(problem.names), len(model.row_names) - len(problem.names)
        lower, upper = model.row_bounds(problem)
        slack = FEASIBILITY_TOLERANCE * model.row_scales
        self._lower, self._upper = _down(lower - slack)[: self._rows], _up(upper + slack)[: self._rows]
        self._p = np.stack([problem.p] * 2, axis=-1)
        self._symbols = np.concatenate([np.arange(n), np.full(len(problem.p), -1)])
        self._scale = problem.scale
        # Of x and p to cost and rows; the last n rows are the variables themselves.
        self.function = AffineFunction(model.kernel)
        self.root = np.stack([problem.lower, problem.upper], axis=-1)[None]

    def _prune(self, boxes: Array, target: float) -> Remaining:
        origin, done = np.arange(len(boxes)), list[Remaining]()
        for last in (*(False,) * (ROUNDS - 1), True):
            forms = self._enclose(boxes)
            lowest = forms.lower[:, 0]
            rows = slice(1, 1 + self._rows)
            possible = (forms.lower[:, rows] <= self._upper) & (forms.upper[:, rows] >= self._lower)
            left: Flags = (lowest < target) & possible.all(axis=1)
            boxes, origin, forms = boxes[left], origin[left], AffineForms(*(values[left] for values in forms))
            contracted, cut = self._contract(boxes, forms, target), self._choose_cut(boxes, forms)
            exists = np.asarray((contracted[..., 0] <= contracted[..., 1]).all(axis=-1))
            narrower = np.diff(contracted)[..., 0] < (1.0 - LEAST_SHRINKAGE) * np.diff(boxes)[..., 0]
            again = np.asarray(exists & narrower.any(axis=-1) & (not last), dtype=bool)
            stays = np.asarray(exists & ~again, dtype=bool)
            done.append(Remaining(contracted[stays], forms.lower[stays, 0], cut[stays], origin[stays]))
            boxes, origin = contracted[again], origin[again]
            if not len(boxes):
                break
        return Remaining(*(np.concatenate(columns) for columns in zip(*done, strict=True)))

    def _enclose(self, boxes: Array) -> AffineForms:
        given = np.broadcast_to(self._p, (len(boxes), *self._p.shape))
        return self.function(np.concatenate([boxes, given], axis=1), self._symbols)

    def _contract(self, boxes: Array, forms: AffineForms, target: float) -> Array:
        """Cut off the slabs in which a row or the cost is out of bounds.

        Each bound is a linear inequality of the symbols, a e <= room, to which the other symbols add as much as they can.
        """
        used = slice(0, 1 + self._rows)
        slopes, middle, error = forms.slopes[:, used], forms.middle[:, used], forms.error[:, used]
        bounded = np.isfinite(error)
        error = np.where(bounded, error, 0.0)
        size = np.abs(slopes)
        total = size.sum(axis=-1, keepdims=True)
        upper = np.concatenate([[target], self._upper])
        lower = np.concatenate([[-np.inf], self._lower])
        low, high = np.full(boxes.shape[:2], -1.0), np.full(boxes.shape[:2], 1.0)
        for sign, room in ((1.0, upper - middle + error), (-1.0, middle - lower + error)):
            open_ = bounded & np.isfinite(room)
            available = _up(np.where(open_, room, 0.0)[..., None] + total - size)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                farthest = available / (sign * slopes)
            useful = open_[..., None] & np.isfinite(farthest)
            high = np.minimum(high, _up(np.where(useful & (sign * slopes > 0.0), farthest, 1.0)).min(axis=1))
            low = np.maximum(low, _down(np.where(useful & (sign * slopes < 0.0), farthest, -1.0)).max(axis=1))
        centre = 0.5 * boxes[..., 0] + 0.5 * boxes[..., 1]
        reach = np.maximum(boxes[..., 1] - centre, centre - boxes[..., 0]) * (1.0 + ROUNDING)
        ends = np.stack([_down(centre + low * reach), _up(centre + high * reach)], axis=-1)
        return np.stack([np.maximum(ends[..., 0], boxes[..., 0]), np.minimum(ends[..., 1], boxes[..., 1])], axis=-1)

    def _choose_cut(self, boxes: Array, forms: AffineForms) -> Numbers:
        """Return (P,) the variable with the largest share of the changes of cost and undecided rows, and of the width."""
        used, rows = slice(0, 1 + self._rows), slice(1, 1 + self._rows)
        size = np.abs(forms.slopes[:, used])
        total = size.sum(axis=-1, keepdims=True)
        share = np.divide(size, total, out=np.zeros_like(size), where=total > 0.0)
        undecided = (forms.upper[:, rows] > self._upper) | (forms.lower[:, rows] < self._lower)
        share[:, 1:] *= undecided[..., None]
        width = np.diff(boxes)[..., 0] / self._scale
        relative = width / np.maximum(width.max(axis=-1, keepdims=True), 1e-300)
        score = (share.max(axis=1) + WIDTH_WEIGHT) * relative
        return np.asarray(score.argmax(axis=-1))


class PowerBounds(Bounds):
    """Bounds of the least power over boxes of z, from forms of degree two."""

    def __init__(self, problem: GaitProblem) -> None:
        assert isinstance(problem.least_power, LeastPower)  # see ``has_power_form``
        form = make_power_form(problem, problem.least_power)
        _compare(problem, form)
        self._function, self._poses = QuadraticFunction(form.function), QuadraticFunction(form.poses)
        self._form, self.root = form, form.box[None]

    def to_z(self, x: Array) -> Array:
        """Return the z of the form."""
        return self._form.to_z(x)

    def _prune(self, boxes: Array, target: float) -> Remaining:
        rows = self._form.rows
        _, lower, upper = rows.limits[self._form.pose_rows].T
        contracted, left = self._poses.contract(boxes, lower, upper)
        remaining = self._function.prune(contracted[left], target + WIDENING * abs(target), rows)
        lowest = remaining.lowest - WIDENING * abs(target)  # of the judged problem
        return remaining._replace(lowest=lowest, origin=np.flatnonzero(left)[remaining.origin])


def _compare(problem: GaitProblem, form: PowerForm) -> None:
    """Compare a form with the exact functions at random points of its domain.

    Raises:
        InputError: they differ by more than rounding.
    """
    model, rng = build_exact_model(problem), np.random.default_rng(SEED)
    domain = [k for k, group in enumerate(model.row_groups) if group == "reach"]
    compared = 0
    for _ in range(TRIES):
        x = rng.uniform(problem.lower, problem.upper)
        expected = model.at(x, problem.p)
        if (np.maximum(expected.lower - expected.g, expected.g - expected.upper)[domain] > 0.0).any():
            continue
        for name, value in zip(form.metrics.name_out(), form.metrics.call([form.to_z(x)]), strict=True):
            exact = expected.metrics[name]
            if not abs(float(value) - exact) <= AGREEMENT * (1.0 + abs(exact)):
                raise InputError(
                    f"problem {problem.name!r}: {name} is {float(value)} in its least-power form and {exact} in the exact "
                    "functions; with these options there is no proof"
                )
        compared += 1
        if compared == POINTS:
            return
    raise InputError(f"problem {problem.name!r}: none of {TRIES} random points is within reach")


def _up(values: Array) -> Array:
    return -_down(-values)


def _down(values: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        lowered: Array = np.where(np.isfinite(values), values - ROUNDING * (1.0 + np.abs(values)), values)
    return lowered
