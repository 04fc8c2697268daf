"""Many local solves from random starts, stored in batches, so that an interrupted study can be continued."""

from __future__ import annotations

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

BATCH = 250


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """Where all starts ended.

    Attributes:
        x: (N, n) end points.
        objective: (N,) exact values, in the problem's sense.
        success: (N,) converged, and feasible for the exact functions.
        status: (N,) in words.
    """

    x: Array
    objective: Array
    success: np.ndarray[Any, np.dtype[np.bool_]]
    status: tuple[str, ...]


def multistart(
    problem: GaitProblem,
    store: Store,
    *,
    starts: int,
    seed: int = 0,
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
) -> Ends:
    """Ends of a solver from random starts; batch k draws its start points from the seed and k, whatever ran before.

    Args:
        problem: with its current parameter values.
        store: of finished batches.
        starts: how many.
        seed: of the start points.
        solver: with its settings; None for IPOPT with its defaults.
        progress: told of each batch when it begins and when it is done.

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
        batch = partial(_batch, problem, ready, seed, k, count)
        rows += store.compute(f"starts-{first}", inputs, batch, code=code, progress=progress)
        progress(f"{len(rows)} starts")
    x, objective, success, status = zip(*rows, strict=True)
    return Ends(
        x=np.array(x, dtype=float),
        objective=np.array(objective, dtype=float),  # NaN where null was kept
        success=np.array(success, dtype=bool),
        status=tuple(status),
    )


def _batch(problem: GaitProblem, solver: Solver, seed: int, batch: int, count: int) -> list[list[Any]]:
    """x, objective, success and status of each start of a batch, as plain data."""
    rng = np.random.default_rng([seed, batch])
    rows: list[list[Any]] = []
    for _ in range(count):
        end = solver.run(problem, problem.start_point(rng))
        rows.append([end.x.tolist(), end.objective, bool(end.converged), end.status])
    return list(replace_nan(rows))
