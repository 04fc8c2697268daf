"""What is known of a problem over boxes: a bound of the cost, and the part of a box in which something better may lie."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.kernel.kernel_source import build_kernel
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.proofs.affine import AffineFunction, Forms

Flags = np.ndarray[Any, np.dtype[np.bool_]]
Numbers = np.ndarray[Any, np.dtype[np.intp]]

# Part of some edge that must go for a box to be enclosed anew, and how often that is done.
LEAST_SHRINKAGE = 0.1
ROUNDS = 4
# Widens the few sums taken here, in NumPy, by far more than they can be rounded.
ROUNDING = 1e-12
# Weight of an edge's width beside what it does to cost and rows, for choosing where to cut.
WIDTH_WEIGHT = 0.3


class Assessed(NamedTuple):
    """Boxes in which a feasible point below the target may lie.

    Attributes:
        boxes: (P, n, 2) without the slabs in which there is none.
        lowest: (P,) no feasible point in the box costs less.
        cut: (P,) variable to cut next.
        origin: (P,) numbers of the boxes from which they come.
    """

    boxes: Array
    lowest: Array
    cut: Numbers
    origin: Numbers


class BoxBounds:
    """Affine bounds of a problem's exact functions over boxes of its variables.

    Attributes:
        function: of x and p to cost and rows; the last n rows are the variables themselves.
        whole: (1, n, 2) box of all variables' bounds.
    """

    def __init__(self, problem: GaitProblem) -> None:
        """Read the exact functions.

        Raises:
            InputError: an operation that cannot be enclosed.
            CompilerError: there is no compiler, or it fails.
        """
        kernel = build_kernel(problem)
        n, self._rows = len(problem.names), len(kernel.model.row_names) - len(problem.names)
        lower, upper = kernel.row_bounds(problem)
        slack = FEASIBILITY_TOLERANCE * kernel.model.row_scales
        self._lower, self._upper = _down(lower - slack)[: self._rows], _up(upper + slack)[: self._rows]
        self._p = np.stack([problem.p] * 2, axis=-1)
        self._symbols = np.concatenate([np.arange(n), np.full(len(problem.p), -1)])
        self._scale = problem.scale
        self.function = AffineFunction(kernel.function)
        self.whole = np.stack([problem.lower, problem.upper], axis=-1)[None]

    def assess(self, boxes: Array, target: float) -> Assessed:
        """What is left of boxes (P, n, 2) when no cost of the target or more is of interest; in threads, box by box alike."""
        return in_threads(lambda part: self._assess(part, target), boxes)

    def place(self, x: Array) -> Array:
        """The points themselves."""
        return x

    def _assess(self, boxes: Array, target: float) -> Assessed:
        origin, done = np.arange(len(boxes)), list[Assessed]()
        for last in (*(False,) * (ROUNDS - 1), True):
            forms = self._forms(boxes)
            lowest = forms.lower[:, 0]
            rows = slice(1, 1 + self._rows)
            possible = (forms.lower[:, rows] <= self._upper) & (forms.upper[:, rows] >= self._lower)
            kept: Flags = (lowest < target) & possible.all(axis=1)
            boxes, origin, forms = boxes[kept], origin[kept], Forms(*(part[kept] for part in forms))
            contracted, cut = self._contracted(boxes, forms, target)
            exists = np.asarray((contracted[..., 0] <= contracted[..., 1]).all(axis=-1))
            narrower = np.diff(contracted)[..., 0] < (1.0 - LEAST_SHRINKAGE) * np.diff(boxes)[..., 0]
            again = np.asarray(exists & narrower.any(axis=-1) & (not last), dtype=bool)
            stays = np.asarray(exists & ~again, dtype=bool)
            done.append(Assessed(contracted[stays], forms.lower[stays, 0], cut[stays], origin[stays]))
            boxes, origin = contracted[again], origin[again]
            if not len(boxes):
                break
        return Assessed(*(np.concatenate(columns) for columns in zip(*done, strict=True)))

    def _forms(self, boxes: Array) -> Forms:
        given = np.broadcast_to(self._p, (len(boxes), *self._p.shape))
        return self.function(np.concatenate([boxes, given], axis=1), self._symbols)

    def _contracted(self, boxes: Array, forms: Forms, target: float) -> tuple[Array, Numbers]:
        """Boxes without the slabs in which a row or the cost is out of bounds, and where each is to be cut.

        Each bound is a linear inequality of the symbols, a e <= room, in which the others add as much as they can.
        """
        used = slice(0, 1 + self._rows)
        slopes, middle, error = forms.slopes[:, used], forms.middle[:, used], forms.error[:, used]
        known = np.isfinite(error)
        error = np.where(known, error, 0.0)
        size = np.abs(slopes)
        total = size.sum(axis=-1, keepdims=True)
        upper = np.concatenate([[target], self._upper])
        lower = np.concatenate([[-np.inf], self._lower])
        low, high = np.full(boxes.shape[:2], -1.0), np.full(boxes.shape[:2], 1.0)
        for sign, room in ((1.0, upper - middle + error), (-1.0, middle - lower + error)):
            open_ = known & np.isfinite(room)
            available = _up(np.where(open_, room, 0.0)[..., None] + total - size)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                farthest = available / (sign * slopes)
            useful = open_[..., None] & np.isfinite(farthest)
            high = np.minimum(high, _up(np.where(useful & (sign * slopes > 0.0), farthest, 1.0)).min(axis=1))
            low = np.maximum(low, _down(np.where(useful & (sign * slopes < 0.0), farthest, -1.0)).max(axis=1))
        centre = 0.5 * boxes[..., 0] + 0.5 * boxes[..., 1]
        reach = np.maximum(boxes[..., 1] - centre, centre - boxes[..., 0]) * (1.0 + ROUNDING)
        ends = np.stack([_down(centre + low * reach), _up(centre + high * reach)], axis=-1)
        inner = np.stack([np.maximum(ends[..., 0], boxes[..., 0]), np.minimum(ends[..., 1], boxes[..., 1])], axis=-1)
        return inner, self._cut(boxes, forms)

    def _cut(self, boxes: Array, forms: Forms) -> Numbers:
        """(P,) variable with the largest share of how cost and undecided rows move, and of the box's width."""
        used = slice(0, 1 + self._rows)
        size = np.abs(forms.slopes[:, used])
        total = size.sum(axis=-1, keepdims=True)
        share = np.divide(size, total, out=np.zeros_like(size), where=total > 0.0)
        rows = slice(1, 1 + self._rows)
        undecided = (forms.upper[:, rows] > self._upper) | (forms.lower[:, rows] < self._lower)
        share[:, 1:] *= undecided[..., None]
        width = np.diff(boxes)[..., 0] / self._scale
        relative = width / np.maximum(width.max(axis=-1, keepdims=True), 1e-300)
        score = (share.max(axis=1) + WIDTH_WEIGHT) * relative
        return np.asarray(score.argmax(axis=-1))


def in_threads(assess: Callable[[Array], Assessed], boxes: Array) -> Assessed:
    """Boxes assessed in parts, box by box alike."""
    parts = np.array_split(np.arange(len(boxes)), max(1, min(available_cores(), len(boxes) // 64)))
    if len(parts) == 1:
        return assess(boxes)
    with ThreadPoolExecutor(len(parts)) as threads:
        found = list(threads.map(lambda part: assess(boxes[part]), parts))
    whole = [np.concatenate(columns) for columns in zip(*found, strict=True)]
    whole[3] = np.concatenate([part[f.origin] for part, f in zip(parts, found, strict=True)])
    return Assessed(*whole)


def halves(boxes: Array, cut: Numbers) -> Array:
    """(2 P, n, 2): each box cut in the middle of an edge."""
    index = np.arange(len(boxes)), cut
    middle = 0.5 * boxes[(*index, 0)] + 0.5 * boxes[(*index, 1)]
    low, high = boxes.copy(), boxes.copy()
    low[(*index, 1)] = middle
    high[(*index, 0)] = middle
    return np.concatenate([low, high])


def _up(values: Array) -> Array:
    return -_down(-values)


def _down(values: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        lowered: Array = np.where(np.isfinite(values), values - ROUNDING * (1.0 + np.abs(values)), values)
    return lowered
