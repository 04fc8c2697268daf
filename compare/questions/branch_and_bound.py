"""Interval branch and bound: a bound on what any feasible x can reach, by enclosures of the exact functions over boxes.

A box is dropped when some row's enclosure shows that no point in it is feasible, or when the cost's enclosure shows that none
betters the incumbent by more than the tolerance. Enclosures are the natural interval extension, cut with the mean-value form.

Source:
    Hansen, Walster (2004), Global Optimization Using Interval Analysis; Moore, Kearfott, Cloud (2009), chapter 6.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nlp_gait.backends.enclosure import Enclosure
from nlp_gait.backends.exact import FEASIBILITY_TOLERANCE, exact_model
from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array, GaitProblem

BATCH = 512
# Widens the few sums taken here, in NumPy, by far more than they can be rounded.
ROUNDING = 1e-12


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What is proven about the best possible objective.

    Attributes:
        objective: exact value of the incumbent, in the problem's sense.
        bound: no x that the judge calls feasible has a better objective than this.
        tolerance: relative distance of both that was asked for.
        closed: that distance was reached.
        boxes: enclosed.
        left: boxes neither dropped nor split at the end.
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
    progress: Callable[[int, float], None] = lambda boxes, bound: None,
) -> Certificate:
    """Bound on the optimum over all variables' bounds.

    Args:
        problem: smooth, with few variables: the work grows exponentially with their number.
        incumbent: (n,) feasible point, the best known.
        tolerance: relative distance of bound and objective at which to stop.
        time_limit_s: wall time after which the bound reached so far is given [s].
        progress: told the boxes enclosed and the bound, in the problem's sense, after each batch.

    Raises:
        InputError: the incumbent is not feasible, or the tolerance or the time limit is not positive.
        CompilerError: there is no compiler, or it fails.
    """
    if not (tolerance > 0.0 and time_limit_s > 0.0):
        raise InputError(f"tolerance and time limit must be positive, got {tolerance}, {time_limit_s} s")
    x = problem.check_x(incumbent)
    cost, violation = (float(v) for v in exact_model(problem).function(x, problem.p)[:2])
    if not violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the incumbent of {problem.name} is infeasible: total violation {violation:.3g}")
    started, used = time.perf_counter(), time.process_time()
    enclosure = Enclosure(problem)
    target = cost - tolerance * abs(cost)
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
        progress(enclosed, bound())
    return Certificate(
        objective=problem.objective.sign * cost,
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
    """Lower bound of the cost (P,), how much each variable moves it (P, n), and the boxes, of those that must be kept."""
    cost, rows = enclosure.values(boxes)
    kept = (cost[:, 0] < target) & _may_be_feasible(enclosure, rows)
    boxes, lowest = boxes[kept], cost[kept, 0]
    if not len(boxes):
        return lowest, np.empty(boxes.shape[:2]), boxes
    middle = boxes.mean(axis=-1)
    reach = np.maximum(boxes[..., 1] - middle, middle - boxes[..., 0])
    at_middle, rows_at_middle = enclosure.values(np.stack([middle, middle], axis=-1))
    gradient, jacobian = enclosure.slopes(boxes)
    with np.errstate(invalid="ignore"):  # an unbounded slope of a variable that does not move: no statement
        smear = np.abs(gradient).max(axis=-1) * reach
        spread = (np.abs(jacobian).max(axis=-1) * reach[:, None, :]).sum(axis=-1)
    lowest = np.fmax(lowest, _down(at_middle[:, 0] - smear.sum(axis=-1)))
    shifted = np.stack([rows_at_middle[..., 0] - spread, rows_at_middle[..., 1] + spread], axis=-1)
    kept = (lowest < target) & _may_be_feasible(enclosure, shifted)
    # An unbounded slope says nothing about where to split: the relative width decides.
    width = reach / enclosure.problem.scale
    smear = np.where(np.isfinite(smear).all(axis=-1, keepdims=True), smear, width)
    return lowest[kept], smear[kept], boxes[kept]


def _may_be_feasible(enclosure: Enclosure, rows: Array) -> Array:
    """(P,) whether each row's enclosure (P, m, 2) meets its bounds, widened by the judge's tolerance."""
    slack = FEASIBILITY_TOLERANCE * enclosure.scales
    outside = (_down(rows[..., 0]) > enclosure.upper + slack) | (-_down(-rows[..., 1]) < enclosure.lower - slack)
    possible: Array = ~outside.any(axis=-1)
    return possible


def _down(values: Array) -> Array:
    lowered: Array = values - ROUNDING * (1.0 + np.abs(values))
    return lowered


def _halves(boxes: Array, smears: Array) -> Array:
    """(2 P, n, 2): each box cut across the variable that moves the cost most."""
    index = np.arange(len(boxes)), smears.argmax(axis=-1)
    middle = boxes[index].mean(axis=-1)
    low, high = boxes.copy(), boxes.copy()
    low[(*index, 1)] = middle
    high[(*index, 0)] = middle
    return np.concatenate([low, high])
