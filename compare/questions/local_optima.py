"""Distinct local optima among the ends of many starts."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from compare.questions.question import Work
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem

BATCH = 250  # starts that are stored together
# Ends are one optimum if their objectives differ by no more than this, relative, and no variable by more than this share of its
# range.
SAME_OBJECTIVE = 1e-5
SAME_X = 0.01
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class StartEnd:
    """End of a start."""

    x: tuple[float, ...]  #: (n,)
    objective: float  #: exact value, in the problem's sense
    feasible: bool  #: converged, and feasible for the exact functions
    status: str  #: in words


@dataclass(frozen=True, kw_only=True)
class LocalOptimum:
    """Distinct local optimum."""

    objective: float  #: of its best end, in the problem's sense
    count: int  #: number of starts that reached it
    share: float  #: of the starts that converged
    x: tuple[float, ...]  #: of its best end


def run_stored_starts(
    problem: GaitProblem, work: Work, *, starts: int, seed: int = 0, solver: Solver | None = None
) -> list[StartEnd]:
    """Run a solver (by default IPOPT) from random starts, in stored batches, with a note about each batch.

    The start points of batch k depend on the seed and k only.

    Raises:
        InputError: fewer than one start.
        OutputError: a batch cannot be stored.
    """
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}")
    solver = solver or IpoptSettings()
    ready = solver.prepare(problem, starts)
    identity = {**fingerprint(problem), "seed": seed, "settings": repr(solver)}
    ends: list[StartEnd] = []
    for k, first in enumerate(range(0, starts, BATCH)):
        count = min(BATCH, starts - first)
        inputs = {**identity, "batch": k, "count": count}
        batch = partial(_run_batch, problem, ready, seed, k, count)
        ends += work.compute(tuple[StartEnd, ...], f"starts-{first}", inputs, batch, code=[sys.modules[__name__]])
        work.progress(f"{len(ends)} starts")
    return ends


def _run_batch(problem: GaitProblem, solver: Solver, seed: int, batch: int, count: int) -> tuple[StartEnd, ...]:
    rng = np.random.default_rng([seed, batch])
    outcomes = [solver.run(problem, problem.start_point(rng)) for _ in range(count)]
    return tuple(
        StartEnd(x=tuple(end.x.tolist()), objective=end.objective, feasible=bool(end.converged), status=end.status)
        for end in outcomes
    )


def cluster_ends(problem: GaitProblem, ends: Sequence[StartEnd]) -> list[LocalOptimum]:
    """Return the distinct optima among the feasible ends, best first."""
    feasible = sorted((end for end in ends if end.feasible), key=lambda end: problem.objective.sign * end.objective)

    def is_same(end: StartEnd, head: StartEnd) -> bool:
        near = abs(end.objective - head.objective) <= SAME_OBJECTIVE * abs(head.objective)
        return near and bool(np.max(np.abs(np.subtract(end.x, head.x)) / problem.scale) <= SAME_X)

    counts: dict[StartEnd, int] = {}  # by the best end of each optimum
    for end in feasible:
        best = next((head for head in counts if is_same(end, head)), end)
        counts[best] = counts.get(best, 0) + 1
    return [
        LocalOptimum(objective=head.objective, count=count, share=count / len(feasible), x=head.x)
        for head, count in counts.items()
    ]


def bound_missed(starts: int) -> float:
    """Return the largest share of starts, with 95 % confidence, that an optimum attracts which none of so many starts reached."""
    return -math.expm1(math.log(1 - CONFIDENCE) / starts)
