"""Interval branch and bound: a bound on what any feasible x can reach, by enclosures of the exact functions over boxes.

A box is dropped when some row's enclosure shows that no point in it is feasible, or when the cost's enclosure shows that none
betters the incumbent by more than the tolerance. Enclosures are the natural interval extension, cut with the mean-value form.

Source:
    Hansen, Walster (2004), Global Optimization Using Interval Analysis; Moore, Kearfott, Cloud (2009), chapter 6.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.study.progress import Progress, unwatched
from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.kernel.enclosure import Enclosure
from nlp_gait.errors import InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import FEASIBILITY_TOLERANCE

Flags = np.ndarray[Any, np.dtype[np.bool_]]

BATCH = 512
# Relative to the target: a natural enclosure wider than this is not worth a gradient.
WIDE = 1.0
# Part of an edge that must go for a box to count as smaller.
LEAST_SHRINKAGE = 0.1
# Widens the few sums taken here, in NumPy, by far more than they can be rounded.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What is proven about the best possible objective.

    Attributes:
        objective: exact value of the incumbent, in the problem's sense.
        bound: no x within the variables' bounds that the judge calls feasible has a better objective than this; not finite
            where the time limit came before any such bound.
        tolerance: requested distance of bound and objective, relative.
        closed: that distance was reached.
        boxes: number that were enclosed.
        left: number of boxes neither dropped nor split at the end.
        time_s: wall time [s].
        cpu_s: processor time [s].
        x: the incumbent.
    """

    objective: float
    bound: float
    tolerance: float
    closed: bool
    boxes: int
    left: int
    time_s: float
    cpu_s: float
    x: tuple[float, ...]

    @property
    def gap(self) -> float:
        """Distance of bound and objective, relative to the objective."""
        return abs(self.bound - self.objective) / abs(self.objective)


def certify(
    problem: GaitProblem,
    incumbent: Array,
    *,
    tolerance: float = 0.01,
    time_limit_s: float = 300.0,
    progress: Progress = unwatched,
) -> Certificate:
    """Bound on the optimum within the variables' bounds.

    Args:
        problem: smooth, with few variables: the work grows exponentially with their number.
        incumbent: (n,) feasible point, the best known.
        tolerance: relative distance of bound and objective at which to stop.
        time_limit_s: wall time after which the bound reached so far is returned [s].
        progress: told the boxes enclosed and the bound, in the problem's sense, after each batch.

    Raises:
        InputError: the incumbent is not feasible, or the tolerance or the time limit is not positive.
        CompilerError: there is no compiler, or it fails.
    """
    if not (tolerance > 0.0 and time_limit_s > 0.0):
        raise InputError(f"tolerance and time limit must be positive, got {tolerance}, {time_limit_s} s")
    x = problem.check_x(incumbent)
    at = exact_model(problem).at(x, problem.p)
    if not at.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the incumbent of {problem.name} is infeasible: total violation {at.violation:.3g}")
    started, used = time.perf_counter(), time.process_time()
    enclosure = Enclosure(problem)
    target = at.cost - tolerance * abs(at.cost)
    boxes = np.stack([problem.lower, problem.upper], axis=-1)[None]
    bounds, smears, boxes = _assessed(enclosure, boxes, target)
    enclosed = 1

    def bound() -> float:
        return problem.objective.sign * min(float(bounds.min(initial=np.inf)), target if not len(bounds) else np.inf)

    while len(bounds) and time.perf_counter() - started < time_limit_s:
        order = np.argsort(bounds)
        chosen, rest = order[:BATCH], order[BATCH:]
        halves = _halves(boxes[chosen], smears[chosen])
        enclosed += len(halves)
        new_bounds, new_smears, new_boxes = _assessed(enclosure, halves, target)
        boxes = np.concatenate([boxes[rest], new_boxes])
        bounds, smears = np.concatenate([bounds[rest], new_bounds]), np.concatenate([smears[rest], new_smears])
        progress(f"{enclosed} boxes, bound {bound():.6g}")
    return Certificate(
        objective=problem.objective.sign * at.cost,
        bound=bound(),
        tolerance=tolerance,
        closed=not len(bounds),
        boxes=enclosed,
        left=len(bounds),
        time_s=time.perf_counter() - started,
        cpu_s=time.process_time() - used,
        x=tuple(x.tolist()),
    )


def _assessed(enclosure: Enclosure, boxes: Array, target: float) -> tuple[Array, Array, Array]:
    """Lower bound of the cost (P,), how much each variable matters (P, n), and the boxes, of those that must be kept."""
    cost, rows = enclosure.values(boxes)
    kept: Flags = (cost[:, 0] < target) & _may_be_feasible(enclosure, rows)
    cost = cost[kept]
    boxes, shrunk, smear = _contracted(enclosure, boxes[kept])
    kept = ~np.any(boxes[..., 0] > boxes[..., 1], axis=-1)
    boxes, cost, smear, shrunk = boxes[kept], cost[kept], smear[kept], shrunk[kept]
    if shrunk.any():
        cost[shrunk] = enclosure.values(boxes[shrunk])[0]
    lowest = cost[:, 0].copy()
    # The mean-value form pays only where the natural extension is good already.
    fine = cost[:, 1] - cost[:, 0] < WIDE * abs(target)
    if fine.any():
        middle, reach = _middle_and_reach(boxes[fine])
        moves = _moves(enclosure.gradient(boxes[fine]), reach)
        at_middle = enclosure.values(np.stack([middle, middle], axis=-1))[0]
        lowest[fine] = np.fmax(lowest[fine], _down(at_middle[:, 0] - moves.sum(axis=-1)))
        smear[fine] = np.where(np.isfinite(moves).all(axis=-1, keepdims=True), moves, smear[fine])
    kept = lowest < target
    return lowest[kept], smear[kept], boxes[kept]


def _contracted(enclosure: Enclosure, boxes: Array) -> tuple[Array, Flags, Array]:
    """Boxes without the slabs in which a row's mean-value form is out of bounds; which shrank; and how rows move (P, n)."""
    middle, reach = _middle_and_reach(boxes)
    rows = enclosure.values(np.stack([middle, middle], axis=-1))[1]
    jacobian = enclosure.jacobian(boxes)
    slack = FEASIBILITY_TOLERANCE * enclosure.scales
    moves = _moves(jacobian, reach[:, None, :])
    total = moves.sum(axis=-1, keepdims=True)
    lower, upper = boxes[..., 0].copy(), boxes[..., 1].copy()
    # Both one-sided forms as row <= 0: J (x - c) <= room, where the other variables take at most total - own.
    for sign, room in (
        (1.0, enclosure.upper + slack - rows[..., 0]),
        (-1.0, rows[..., 1] - enclosure.lower + slack),
    ):
        available = _up(room[..., None] + total - moves)
        slopes = np.sort(sign * jacobian, axis=-1)
        least, most = slopes[..., 0], slopes[..., 1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            farthest = available / np.where((available > 0.0) == (least > 0.0), least, most)
        rising = np.where((least > 0.0) & np.isfinite(farthest), farthest, np.inf)
        falling = np.where((most < 0.0) & np.isfinite(farthest), farthest, -np.inf)
        upper = np.minimum(upper, _up(middle + rising.min(axis=1)))
        lower = np.maximum(lower, _down(middle + falling.max(axis=1)))
    straddling = (
        np.minimum(np.abs(rows[..., 0] - enclosure.upper), np.abs(rows[..., 1] - enclosure.lower)) <= total[..., 0]
    )
    smear = (moves * straddling[..., None]).max(axis=1)
    width = reach / enclosure.problem.scale
    smear = np.where(smear.max(axis=-1, keepdims=True) > 0.0, smear, width)
    # An empty edge shrank too.
    shrunk: Flags = np.any((upper - lower) < (1.0 - LEAST_SHRINKAGE) * 2.0 * reach, axis=-1)
    shrunk |= np.any(lower > upper, axis=-1)
    contracted: Array = np.where(shrunk[:, None, None], np.stack([lower, upper], axis=-1), boxes)
    return contracted, shrunk, smear


def _moves(slopes: Array, reach: Array) -> Array:
    """How far a function can move along each edge: slopes (..., n, 2), reach (..., n)."""
    with np.errstate(invalid="ignore"):  # an unbounded slope along an edge of no length
        steep = np.abs(slopes).max(axis=-1) * reach
    moves: Array = np.where(reach > 0.0, steep, 0.0)
    return moves


def _middle_and_reach(boxes: Array) -> tuple[Array, Array]:
    """(P, n) middle, and no less than the distance of both ends from it."""
    middle = boxes.mean(axis=-1)
    reach = np.maximum(boxes[..., 1] - middle, middle - boxes[..., 0]) * (1.0 + ROUNDING)
    return middle, reach


def _may_be_feasible(enclosure: Enclosure, rows: Array) -> Flags:
    """(P,) whether each row's enclosure (P, m, 2) meets its bounds, widened by the judge's tolerance."""
    slack = FEASIBILITY_TOLERANCE * enclosure.scales
    outside = (_down(rows[..., 0]) > enclosure.upper + slack) | (-_down(-rows[..., 1]) < enclosure.lower - slack)
    possible: Flags = ~np.any(outside, axis=-1)
    return possible


def _up(values: Array) -> Array:
    return -_down(-values)


def _down(values: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        lowered: Array = np.where(np.isfinite(values), values - ROUNDING * (1.0 + np.abs(values)), values)
    return lowered


def _halves(boxes: Array, smears: Array) -> Array:
    """(2 P, n, 2): each box cut across the variable that moves the cost most."""
    index = np.arange(len(boxes)), smears.argmax(axis=-1)
    middle = boxes[index].mean(axis=-1)
    low, high = boxes.copy(), boxes.copy()
    low[(*index, 1)] = middle
    high[(*index, 0)] = middle
    return np.concatenate([low, high])
