"""Ranking of the solvers on the suite: by expected running time and by solved targets, with tests against every other solver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns, compare_problems, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS, a12, holm, rank_sum, signed_rank
from compare.bench.baseline import load_baseline
from compare.study.record import RunRecord

ALPHA = 0.05
# Relative gap below which two results are equal; also COCO's precision.
SAME = 1e-8


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


@dataclass(frozen=True, kw_only=True)
class Duel:
    """Comparison of a solver with another one, Holm-corrected."""

    other: str  #: name of the other solver
    #: Number of instances on which the rank-sum test finds the solver better, corrected over all duels and instances
    better: int
    worse: int  #: likewise
    undecided: int  #: number of the other instances
    mean_a12: float  #: probability that a run of the solver is better, mean over instances
    signed_rank: float  #: p-value over the median gaps of all instances, corrected over all duels


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaderboard:
    """All solvers on some instances."""

    comparisons: tuple[Comparison, ...]  #: one for each instance, with gaps from the best known objective
    standings: tuple[Standing, ...]  #: best mean rank first

    def place(self, solver: str) -> int:
        """Return the place of a solver, from 1."""
        return [standing.solver for standing in self.standings].index(solver) + 1

    def duels(self, solver: str) -> list[Duel]:
        """Compare a solver with every other one, in the order of the standings."""
        others = [standing.solver for standing in self.standings if standing.solver != solver]
        found, _ = index_solvers(self.comparisons)
        if not others:
            return []
        gaps = {name: [self._gaps(on[name], k) for k, on in enumerate(found)] for name in (solver, *others)}
        p = np.array([[rank_sum(a, b) for a, b in zip(gaps[solver], gaps[other], strict=True)] for other in others])
        effect = np.array([[a12(a, b) for a, b in zip(gaps[solver], gaps[other], strict=True)] for other in others])
        real = holm(p.ravel().tolist()).reshape(p.shape) < ALPHA
        medians = {name: [float(np.sort(gap)[len(gap) // 2]) for gap in on_all] for name, on_all in gaps.items()}
        overall = holm([signed_rank(medians[solver], medians[other]) for other in others])
        return [
            Duel(
                other=other,
                better=int((real[k] & (effect[k] > 0.5)).sum()),
                worse=int((real[k] & (effect[k] < 0.5)).sum()),
                undecided=int((~real[k]).sum()),
                mean_a12=float(effect[k].mean()),
                signed_rank=float(overall[k]),
            )
            for k, other in enumerate(others)
        ]

    def _gaps(self, runs: SolverRuns, number: int) -> list[float]:
        """Final gap of each run on an instance, at least ``SAME``."""
        return [
            max(self.comparisons[number].gap(cost), SAME) if math.isfinite(cost) else math.inf for cost in runs.costs
        ]


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
    ranks = rankdata(rows, axis=1).mean(axis=0) if len(rows) else np.full(len(names), math.nan)
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
