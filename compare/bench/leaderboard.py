"""Ranking of the solvers on the suite: by expected running time and by solved targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.comparison import Comparison, compare_problems, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS
from compare.bench.baseline import load_baseline
from compare.study.record import RunRecord
from nlp_gait import gaitbench
from nlp_gait.gaitbench.generated import is_generated, parse_id

FEW_VARIABLES = 10


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A solver's place on the suite."""

    solver: str
    #: Of its expected running time, over all pairs of instance and target (``TARGETS``) that a solver reached; equals share a
    #: rank
    mean_rank: float
    #: Share of all triples of instance, run and target (31, from 100 % to 1e-4 % above the best known) that it solved
    solved: float
    solved_rank: int  #: place by that share
    feasible: float  #: share of its runs that end feasible
    reached: tuple[int, ...]  #: number of instances on which it reached a target at least once, by target


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaderboard:
    """All solvers on some instances."""

    comparisons: tuple[Comparison, ...]  #: one for each instance, with gaps from the best known objective
    standings: tuple[Standing, ...]  #: best mean rank first

    def place(self, solver: str) -> int:
        """Return the place of a solver, from 1."""
        return [standing.solver for standing in self.standings].index(solver) + 1


def rank_solvers(instances: Sequence[str], records: Sequence[RunRecord] = (), *, shipped: bool = True) -> Leaderboard:
    """Rank the solvers of records, and of the baseline if ``shipped``; raises InputError for an instance without baseline."""
    everything = [
        record
        for id in instances
        for record in (*(load_baseline(id) if shipped else ()), *records)
        if record.problem == id
    ]
    comparisons = tuple(compare_problems(everything))
    return Leaderboard(comparisons=comparisons, standings=tuple(_standings(comparisons)))


def _standings(comparisons: Sequence[Comparison]) -> list[Standing]:
    from scipy.stats import rankdata

    found, names = index_solvers(comparisons)
    costs = np.array([[[on[name].expected_cost(t) for name in names] for t in TARGETS] for on in found])
    rows = costs.reshape(-1, len(names))
    rows = rows[np.isfinite(rows).any(axis=1)]
    equal = (len(names) + 1) / 2  # where no solver reaches a target
    ranks = rankdata(rows, axis=1).mean(axis=0) if len(rows) else np.full(len(names), equal)
    solved = [
        float(
            np.mean([math.isfinite(c.cost_to_reach(t)) for on in found for c in on[name].curves for t in ECDF_TARGETS])
        )
        for name in names
    ]
    places = rankdata([-share for share in solved], method="min")
    return sorted(
        (
            Standing(
                solver=name,
                mean_rank=float(ranks[k]),
                solved=solved[k],
                solved_rank=int(places[k]),
                feasible=float(np.mean([math.isfinite(cost) for on in found for cost in on[name].costs])),
                reached=tuple(int(np.isfinite(costs[:, t, k]).sum()) for t in range(len(TARGETS))),
            )
            for k, name in enumerate(names)
        ),
        key=lambda standing: (standing.mean_rank, standing.solved_rank),
    )


def filter_instances(instances: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
    """Return all instances, and those of each family and of few or many variables where that is a part of them."""
    parts = {"all instances": tuple(instances)}
    for id in instances:
        instance = gaitbench.load(id)
        family = parse_id(id)[0].name if is_generated(id) else instance.definition.problem
        size = "up to" if len(instance.names) <= FEW_VARIABLES else "more than"
        for name in (f"family {family}", f"{size} {FEW_VARIABLES} variables"):
            parts[name] = (*parts.get(name, ()), id)
    return {name: part for name, part in parts.items() if name == "all instances" or len(part) < len(instances)}
