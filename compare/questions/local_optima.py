"""Distinct local optima among the ends of many starts, and estimates of those that no start reached."""

import math
import sys
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.study.store import Store
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.files import replace_nan
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.progress import Progress, ignore_progress

BATCH = 250  # starts that are stored together
# Ends are one optimum if their objectives differ by no more than this, relative, and no variable by more than this share of its
# range.
SAME_OBJECTIVE = 1e-5
SAME_X = 0.01
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """Ends of all starts."""

    x: Array  #: (N, n) end points
    objective: Array  #: (N,) exact values, in the problem's sense
    feasible: np.ndarray[Any, np.dtype[np.bool_]]  #: (N,) converged, and feasible for the exact functions
    status: tuple[str, ...]  #: (N,) in words


@dataclass(frozen=True, kw_only=True)
class LocalOptimum:
    """Distinct local optimum."""

    objective: float  #: of its best end, in the problem's sense
    count: int  #: number of starts that reached it
    share: float  #: of the starts that converged
    x: tuple[float, ...]  #: of its best end


@dataclass(frozen=True, kw_only=True)
class UnseenOptima:
    """Estimates from N starts of the optima that none of them reached. They are support, not proof: N is finite.

    Source:
        Good (1953), The population frequencies of species and the estimation of population parameters; Boender, Rinnooy Kan
        (1987), Bayesian stopping rules for multistart global optimization methods, Mathematical Programming 37.
    """

    good_turing: float  #: share of starts that would reach an unseen optimum: the optima reached once, divided by N
    #: Expected number of all local optima, for a uniform prior on their number and shares; None if the sample is too small
    expected_optima: float | None
    expected_covered: (
        float | None
    )  #: expected share of starts that reach seen optima, for the same prior; None likewise
    largest_missed: float  #: upper bound, with 95 % confidence, of the share of starts that one unseen optimum attracts


def run_stored_starts(
    problem: GaitProblem,
    store: Store,
    *,
    starts: int,
    seed: int = 0,
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
) -> Ends:
    """Run a solver (by default IPOPT) from random starts, in stored batches, with a note about each of them.

    The start points of batch k depend on the seed and k only.

    Raises:
        InputError: fewer than one start.
        OutputError: a batch cannot be stored.
    """
    if starts < 1:
        raise InputError(f"starts must be at least 1, got {starts}")
    chosen = solver or IpoptSettings()
    ready = chosen.prepare(problem, starts)
    code = [sys.modules[__name__]]
    identity = {**fingerprint(problem), "seed": seed, "settings": repr(chosen)}
    rows: list[list[Any]] = []
    for k, first in enumerate(range(0, starts, BATCH)):
        count = min(BATCH, starts - first)
        inputs = {**identity, "batch": k, "count": count}
        batch = partial(_run_batch, problem, ready, seed, k, count)
        rows += store.compute(f"starts-{first}", inputs, batch, code=code, progress=progress)
        progress(f"{len(rows)} starts")
    x, objective, feasible, status = zip(*rows, strict=True)
    return Ends(
        x=np.array(x, dtype=float),
        objective=np.array(objective, dtype=float),  # NaN where null was stored
        feasible=np.array(feasible, dtype=bool),
        status=tuple(status),
    )


def _run_batch(problem: GaitProblem, solver: Solver, seed: int, batch: int, count: int) -> list[list[Any]]:
    """Return x, objective, feasible and status of each start of a batch, as plain data."""
    rng = np.random.default_rng([seed, batch])
    rows: list[list[Any]] = []
    for _ in range(count):
        end = solver.run(problem, problem.start_point(rng))
        rows.append([end.x.tolist(), end.objective, bool(end.converged), end.status])
    return list(replace_nan(rows))


def cluster_ends(problem: GaitProblem, ends: Ends) -> list[LocalOptimum]:
    """Return the distinct optima among the feasible ends, best first."""
    feasible = np.flatnonzero(ends.feasible)
    order: list[int] = feasible[np.argsort(problem.objective.sign * ends.objective[feasible], kind="stable")].tolist()
    scaled = ends.x / problem.scale

    def same(i: int, head: int) -> bool:
        near = abs(ends.objective[i] - ends.objective[head]) <= SAME_OBJECTIVE * abs(ends.objective[head])
        return bool(near and np.max(np.abs(scaled[i] - scaled[head])) <= SAME_X)

    counts: dict[int, int] = {}  # by the best end of each optimum
    for i in order:
        best = next((head for head in counts if same(i, head)), i)
        counts[best] = counts.get(best, 0) + 1
    return [
        LocalOptimum(
            objective=float(ends.objective[head]),
            count=count,
            share=count / len(feasible),
            x=tuple(ends.x[head].tolist()),
        )
        for head, count in counts.items()
    ]


def estimate_unseen(optima: list[LocalOptimum]) -> UnseenOptima:
    """Estimate the unseen optima from the counts of at least one optimum."""
    counts: Array = np.array([optimum.count for optimum in optima], dtype=float)
    n, w = float(counts.sum()), float(len(counts))
    return UnseenOptima(
        good_turing=float((counts == 1).sum()) / n,
        expected_optima=w * (n - 1) / (n - w - 2) if n > w + 2 else None,
        expected_covered=(n - w - 1) * (n + w) / (n * (n - 1)) if n > w + 1 else None,
        largest_missed=-math.expm1(math.log(1 - CONFIDENCE) / n),
    )
