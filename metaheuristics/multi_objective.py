"""Minimisation of several objectives at once by population-based algorithms of the package pymoo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Protocol

import numpy as np

from metaheuristics.adapters.pymoo import PymooSettings
from metaheuristics.array import Array
from metaheuristics.errors import SearchError
from metaheuristics.interface import Bounded, Start
from metaheuristics.preparation import checked_seed, completed, prepared

MODULES: Mapping[str, str] = MappingProxyType({"NSGA2": "moo.nsga2", "CMOPSO": "moo.cmopso"})


class ManyObjectives(Bounded, Protocol):
    """Objectives to be minimised within bounds, called on many points at once."""

    @property
    def count(self) -> int:
        """Number of objectives, m."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Objectives (P, m), finite and all of comparable size, and total violations (P,) of points (P, n)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MultiObjective(PymooSettings):
    """An algorithm of pymoo for several objectives, ``"NSGA2"`` or ``"CMOPSO"``; a population of 100 is pymoo's own choice.

    Source:
        Deb et al. (2002), NSGA-II; Zhang et al. (2018), A competitive mechanism based multi-objective particle swarm
        optimizer with fast convergence.
    """

    population: int = 100
    modules: ClassVar[Mapping[str, str]] = MODULES

    def check_budgets(self, evaluations: Sequence[int]) -> None:
        """Refuse budgets that this algorithm cannot be looked at after.

        Raises:
            SearchError: they do not rise, or the first one is less than a generation.
        """
        budgets = list(evaluations)
        if not budgets or budgets != sorted(set(budgets)) or budgets[0] < self.population:
            raise SearchError(
                f"evaluations must rise and begin with at least the population of {self.population}, got {budgets}"
            )


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Snapshot:
    """Feasible points of a run that no other point of its population betters in all objectives.

    Attributes:
        evaluations: used until then.
        X: (k, n) points; none as long as the population has no feasible one.
        F: (k, m) objectives.
    """

    evaluations: int
    X: Array
    F: Array


def minimize_many(
    objectives: ManyObjectives,
    algorithm: MultiObjective,
    *,
    evaluations: Sequence[int] = (10_000,),
    seed: int = 0,
    progress: Callable[[int], None] = lambda used: None,
) -> tuple[Snapshot, ...]:
    """One run, looked at each time that another budget is used; no algorithm here knows its budget, so each look is a run of it.

    Args:
        objectives: what to minimise.
        algorithm: settings.
        evaluations: budgets, rising; each at least the population. Of the last generation before each only whole ones count.
        seed: of starting points and search; equal seeds start alike whatever the algorithm.
        progress: told the evaluations used, after each generation.

    Returns:
        A snapshot for each budget.

    Raises:
        SearchError: an argument is not allowed, or an objective is not finite.
    """
    algorithm.check_budgets(evaluations)
    budgets = list(evaluations)
    start = prepared(objectives, algorithm.population, budgets[-1], checked_seed(seed))
    search = algorithm.begun(start, objectives.count)
    if algorithm.algorithm == "CMOPSO":
        _seed_elites(search)

    snapshots: list[Snapshot] = []
    used = 0
    while True:
        infills = search.ask()
        while budgets and used + len(infills) > budgets[0]:
            snapshots.append(_snapshot(search, start, used))
            budgets.pop(0)
        if not budgets:
            return tuple(snapshots)
        F, violation = objectives(completed(infills.get("X"), start.lower, start.upper))
        if not np.all(np.isfinite(F)):
            raise SearchError("an objective is not finite; give a large finite number where it has no value")
        # A violation that is not finite counts as the worst.
        infills.set("F", np.array(F), "G", np.nan_to_num(violation, nan=1e30, posinf=1e30)[:, None])
        for individual in infills:
            individual.H, individual.evaluated = np.zeros(0), {"F", "G", "H"}
        search.tell(infills=infills)
        used += len(infills)
        progress(used)


def _seed_elites(search: Any) -> None:
    """pymoo thins out CMOPSO's elites with a generator of its own, unseeded: with this, equal seeds give equal runs."""
    tournament = search.elites.truncation.survival

    def truncated(members: Any, count: int) -> Any:
        return tournament.do(search.problem, members, n_survive=count, random_state=search.random_state)

    search.elites.truncation = truncated


def _snapshot(search: Any, start: Start, used: int) -> Snapshot:
    feasible = search.opt[search.opt.get("FEAS")[:, 0]]
    problem = search.problem
    return Snapshot(
        evaluations=used,
        X=completed(feasible.get("X").astype(float).reshape(len(feasible), problem.n_var), start.lower, start.upper),
        F=feasible.get("F").astype(float).reshape(len(feasible), problem.n_obj),
    )
