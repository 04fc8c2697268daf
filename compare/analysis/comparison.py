"""The runs of all solvers on one problem, brought to one scale: what tables, figures and verdicts are made from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from compare.analysis.statistics.run_length import (
    Curve,
    Weighting,
    best_known,
    curve,
    expected_running_time,
    relative_gap,
)
from compare.study.record import RunRecord
from nlp_gait.decoding import decoded
from nlp_gait.errors import InputError
from nlp_gait.files import refusing
from nlp_gait.formulation import Objective

DEFAULT_WEIGHTING = Weighting()


@dataclass(frozen=True, kw_only=True, eq=False)
class SolverRuns:
    """All runs of one solver, by number.

    Attributes:
        name: of the solver.
        records: ascending in the run's number.
        curves: of each run.
        costs: judge's objective of each run, to be minimised; infinite where it is not feasible.
    """

    name: str
    records: tuple[RunRecord, ...]
    curves: tuple[Curve, ...]
    costs: tuple[float, ...]

    @property
    def feasible(self) -> list[float]:
        """Costs of the feasible runs, best first."""
        return sorted(cost for cost in self.costs if math.isfinite(cost))

    @property
    def median_cost(self) -> float:
        """Over all runs, infinite if half of them or more are infeasible."""
        ordered = sorted(self.costs)
        low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
        return math.inf if math.isinf(high) else (low + high) / 2

    @property
    def best(self) -> RunRecord | None:
        """Best feasible run, None without one."""
        index = int(np.argmin(self.costs))
        return self.records[index] if math.isfinite(self.costs[index]) else None

    def knows(self, axis: str) -> bool:
        """Whether the cost of every run is known, in evaluations or seconds; of results from elsewhere it may not be."""
        return all(bool(np.isfinite(getattr(curve, axis)).all()) for curve in self.curves)

    def expected_cost(self, target: float, axis: str = "evaluations") -> float:
        """Expected running time to a relative gap, in equivalent evaluations or seconds; NaN where costs are not known."""
        if not self.knows(axis):
            return math.nan
        reached = [c.reached(target, axis) for c in self.curves]
        return expected_running_time(reached, [c.total(axis) for c in self.curves])


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """All solvers on one problem, the best median first.

    Attributes:
        problem: label.
        objective: name, unit, sense.
        reference: best objective known: gaps are measured from it; NaN if nothing feasible was found.
        weighting: of calls.
        solvers: with their runs.
    """

    problem: str
    objective: Objective
    reference: float
    weighting: Weighting
    solvers: tuple[SolverRuns, ...]

    @property
    def records(self) -> list[RunRecord]:
        """Of all solvers."""
        return [record for solver in self.solvers for record in solver.records]

    @cached_property
    def reference_holder(self) -> RunRecord | None:
        """Run that found the best objective known."""
        feasible = [record for record in self.records if record.verdict.feasible]
        return min(feasible, key=lambda r: self.objective.sign * r.verdict.objective, default=None)

    def value(self, cost: float) -> float:
        """Objective in the problem's sense."""
        return self.objective.sign * cost

    def gap(self, cost: float) -> float:
        """Relative distance of a cost from the best objective known."""
        return relative_gap(self.value(cost), self.reference, self.objective)


def compare_problems(
    records: Sequence[RunRecord],
    weighting: Weighting = DEFAULT_WEIGHTING,
    references: Mapping[str, float] = MappingProxyType({}),
) -> list[Comparison]:
    """One comparison for each problem among records, in their order.

    Args:
        records: of all runs.
        weighting: of calls.
        references: by problem, the objective that gaps are measured from; without one, the best of its own records.

    Raises:
        InputError: runs of one problem disagree on its objective.
    """
    problems = dict.fromkeys(record.problem for record in records)
    return [
        _comparison(name, [r for r in records if r.problem == name], weighting, references.get(name))
        for name in problems
    ]


def _comparison(problem: str, records: Sequence[RunRecord], weighting: Weighting, known: float | None) -> Comparison:
    objective = objective_of(records[0])
    for record in records:
        if objective_of(record) != objective:
            raise InputError(f"records of {problem!r} disagree on the objective: {record.algorithm}, run {record.run}")
    reference = best_known(records, objective) if known is None else known
    solvers = []
    for name in dict.fromkeys(record.algorithm for record in records):
        runs = tuple(sorted((r for r in records if r.algorithm == name), key=lambda r: r.run))
        solvers.append(
            SolverRuns(
                name=name,
                records=runs,
                curves=tuple(curve(r, objective, reference, weighting) for r in runs),
                costs=tuple(objective.sign * r.verdict.objective if r.verdict.feasible else math.inf for r in runs),
            )
        )
    solvers.sort(key=lambda s: (s.median_cost, min(s.costs), s.name))
    return Comparison(
        problem=problem, objective=objective, reference=reference, weighting=weighting, solvers=tuple(solvers)
    )


def objective_of(record: RunRecord) -> Objective:
    """Objective that a record was made for.

    Raises:
        InputError: the record does not say, or what it says is not an objective.
    """
    with refusing(f"record of {record.algorithm}, run {record.run}", InputError):
        return decoded(Objective, record.definition.get("objective"), "objective")
