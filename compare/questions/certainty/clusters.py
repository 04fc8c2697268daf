"""Distinct local optima among the ends of many starts, and what their shares say about those that were never reached."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from compare.questions.certainty.multistart import Ends
from metaheuristics.array import Array
from nlp_gait.formulation import GaitProblem

# Ends are one optimum if their objectives differ by no more than this, relative, and no variable by more than this part of
# its range.
SAME_OBJECTIVE = 1e-5
SAME_X = 0.01
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class LocalOptimum:
    """A distinct local optimum, and how often it was reached.

    Attributes:
        objective: of the best end in it, in the problem's sense.
        count: number of starts that ended in it.
        share: of the starts that converged.
        x: of the best end.
    """

    objective: float
    count: int
    share: float
    x: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Unseen:
    """What a sample of N starts says about optima that none of them reached. Support, not proof: N is finite.

    Attributes:
        good_turing: share of starts that would end in an unseen optimum: optima reached once, divided by N.
        expected_optima: expected number of all local optima, under a uniform prior on their number and shares; None if the
            sample is too small for it.
        expected_covered: expected share of starts that end in seen optima, under the same prior; None likewise.
        largest_missed: with 95 % confidence no single unseen optimum attracts more than this share of the starts.

    Source:
        Good (1953), The population frequencies of species and the estimation of population parameters; Boender, Rinnooy Kan
        (1987), Bayesian stopping rules for multistart global optimization methods, Mathematical Programming 37.
    """

    good_turing: float
    expected_optima: float | None
    expected_covered: float | None
    largest_missed: float


def cluster(problem: GaitProblem, ends: Ends) -> list[LocalOptimum]:
    """Distinct optima among the ends that converged and are feasible, best first."""
    kept = np.flatnonzero(ends.success)
    order: list[int] = kept[np.argsort(problem.objective.sign * ends.objective[kept], kind="stable")].tolist()
    scaled = ends.x / problem.scale

    def same(i: int, head: int) -> bool:
        near = abs(ends.objective[i] - ends.objective[head]) <= SAME_OBJECTIVE * abs(ends.objective[head])
        return bool(near and np.max(np.abs(scaled[i] - scaled[head])) <= SAME_X)

    counts: dict[int, int] = {}  # by the best end of each
    for i in order:
        best = next((head for head in counts if same(i, head)), i)
        counts[best] = counts.get(best, 0) + 1
    return [
        LocalOptimum(
            objective=float(ends.objective[head]),
            count=count,
            share=count / len(kept),
            x=tuple(ends.x[head].tolist()),
        )
        for head, count in counts.items()
    ]


def unseen(optima: list[LocalOptimum]) -> Unseen:
    """Estimates from the counts of at least one optimum."""
    counts: Array = np.array([optimum.count for optimum in optima], dtype=float)
    n, w = float(counts.sum()), float(len(counts))
    return Unseen(
        good_turing=float((counts == 1).sum()) / n,
        expected_optima=w * (n - 1) / (n - w - 2) if n > w + 2 else None,
        expected_covered=(n - w - 1) * (n + w) / (n * (n - 1)) if n > w + 1 else None,
        largest_missed=-math.expm1(math.log(1 - CONFIDENCE) / n),
    )
