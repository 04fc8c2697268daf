"""Fronts that evolutionary searches find, by exact functions, and how far they stop from the true one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from compare.questions.pareto.competing import CompetingObjective
from compare.questions.pareto.front import FrontPoint, nondominated
from compare.study.store import Store
from metaheuristics.array import Array
from metaheuristics.multi_objective import FrontAlgorithm, front_algorithm, minimize_many
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import Progress, ignore_progress

# The corner that is dominated by every counted point, with the ranges of the true front as 1: a tenth beyond its worst values.
REFERENCE = 1.1


class Scale:
    """Power and criterion as numbers to be minimised, 0 at the best and 1 at the worst value on the true front."""

    def __init__(self, front: Sequence[FrontPoint]) -> None:
        powers, values = ([getattr(p, key) for p in front] for key in ("power_W", "value"))
        self.least_power, self.power_range = min(powers), max(powers) - min(powers)
        self.largest, self.range = max(values), max(values) - min(values)

    def __call__(self, values: Array, powers: Array) -> Array:
        """(P, 2) from criterion (P,) and power (P,)."""
        return np.column_stack([(powers - self.least_power) / self.power_range, (self.largest - values) / self.range])

    def back(self, F: Array) -> tuple[Array, Array]:
        """Criterion and power of (P, 2)."""
        return self.largest - self.range * F[:, 1], self.least_power + self.power_range * F[:, 0]


class PowerAndCompeting:
    """The compiled objective with a criterion beside the power; see ``metaheuristics.multi_objective.ManyObjectives``.

    Its constraints are those that its problem names, each with its worst row.
    """

    def __init__(self, objective: CompiledObjective, criterion: CompetingObjective, scale: Scale) -> None:
        self.names, self.lower, self.upper, self.count = objective.names, objective.lower, objective.upper, 2
        self._objective, self._criterion, self._scale = objective, criterion, scale
        self.inequalities, self.groups = objective.inequalities, objective.groups

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Objectives (P, 2) and violations (P,)."""
        power, violation = self._objective(X)
        return self._scale(self._criterion.values(self._objective, X), power), violation


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchFront:
    """Feasible nondominated points of one run after a budget.

    Attributes:
        algorithm: its name.
        run: number.
        budget: evaluations allowed.
        values: (k,) criterion.
        powers: (k,) [W].
        X: (k, n).
    """

    algorithm: str
    run: int
    budget: int
    values: Array
    powers: Array
    X: Array


def search_fronts(
    problem: GaitProblem,
    criterion: CompetingObjective,
    scale: Scale,
    store: Store,
    *,
    searches: Mapping[str, Sequence[int]],
    runs: int,
    seed: int,
    progress: Progress = ignore_progress,
) -> list[SearchFront]:
    """Fronts of all runs; each run is stored when it is finished.

    Args:
        problem: with the criterion's demand dropped.
        criterion: beside power.
        scale: of both, so that no algorithm's distances are dominated by one of them.
        store: of finished runs.
        searches: rising numbers of evaluations by algorithm.
        runs: run k uses seed + k.
        seed: of the first run.
        progress: told which run is done.

    Raises:
        SearchError: an unknown algorithm, or a budget that is not allowed.
        OutputError: a run cannot be stored.
    """
    compiled = PowerAndCompeting(compile_objective(problem), criterion, scale)
    ranges = [scale.least_power, scale.power_range, scale.largest, scale.range]
    identity = {**fingerprint(problem), "criterion": criterion.name, "scale": ranges}
    fronts = []
    for name, budgets in searches.items():
        algorithm = front_algorithm(name)
        for run in range(runs):
            inputs = {**identity, "budgets": list(budgets), "algorithm": repr(algorithm), "seed": seed + run}
            compute = partial(_snapshots, compiled, algorithm, budgets, seed + run)
            stored = store.compute(f"{name.lower()}-{run}", inputs, compute)
            for budget, snapshot in zip(budgets, stored, strict=True):
                values, powers = scale.back(np.array(snapshot["F"]).reshape(-1, 2))
                X = np.array(snapshot["X"]).reshape(-1, len(problem.names))
                fronts.append(SearchFront(algorithm=name, run=run, budget=budget, values=values, powers=powers, X=X))
            progress(f"{name}, run {run}")
    return fronts


def _snapshots(
    compiled: PowerAndCompeting, algorithm: FrontAlgorithm, budgets: Sequence[int], seed: int
) -> list[dict[str, Any]]:
    """What one run had found after each budget, as plain data."""
    snapshots = minimize_many(compiled, algorithm, evaluations=budgets, seed=seed)
    return [{"F": s.F.tolist(), "X": s.X.tolist()} for s in snapshots]


def best_of_all(fronts: Sequence[SearchFront]) -> list[FrontPoint]:
    """Points of all runs that none of them betters: if these are on or behind a front, all points are."""
    points = [
        FrontPoint(demanded=v, value=v, power_W=w, violation=0.0, x=tuple(x))
        for front in fronts
        for v, w, x in zip(front.values.tolist(), front.powers.tolist(), front.X.tolist(), strict=True)
    ]
    return nondominated(points)
