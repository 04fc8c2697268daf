"""Minimisation of several objectives at once by population-based algorithms of the package pymoo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from metaheuristics.array import Array
from metaheuristics.errors import SearchError
from metaheuristics.interface import Bounded
from metaheuristics.preparation import checked_bounds, checked_seed, child, starting_points
from metaheuristics.settings import bad_setting, check_count

MODULES: Mapping[str, str] = MappingProxyType({"NSGA2": "moo.nsga2", "CMOPSO": "moo.cmopso"})


class ManyObjectives(Bounded, Protocol):
    """Objectives to be minimised within bounds, called on many points at once."""

    @property
    def count(self) -> int:
        """Number of objectives, m."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Objectives (P, m), finite and all of comparable size, and total violations (P,) of points (P, n)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MultiObjective:
    """An algorithm of pymoo with its own defaults, begun from uniform starting points.

    Attributes:
        algorithm: ``"NSGA2"`` or ``"CMOPSO"``.
        population: points in a generation; 100 is pymoo's own choice.
        settings: further arguments of pymoo's class.

    Raises:
        SearchError: unknown algorithm, a setting is not allowed, or pymoo is not installed.

    Source:
        Blank, Deb (2020), pymoo: Multi-objective optimization in Python; Deb et al. (2002), NSGA-II; Zhang et al. (2018),
        A competitive mechanism based multi-objective particle swarm optimizer with fast convergence.
    """

    algorithm: str
    population: int = 100
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.algorithm not in MODULES:
            raise bad_setting(self, "algorithm", f"one of {', '.join(MODULES)}")
        check_count(self, "population", at_least=5)
        if find_spec("pymoo") is None:
            raise SearchError(
                f"algorithm {self.algorithm!r} needs the package pymoo, which is not installed: "
                "pip install 'nlp-gait[algorithms]'"
            )

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
    from pymoo.core.problem import Problem
    from pymoo.core.termination import NoTermination

    lower, upper = checked_bounds(objectives)
    sequence = checked_seed(seed)
    free = np.flatnonzero(upper > lower)
    problem = Problem(n_var=free.size, n_obj=objectives.count, n_ieq_constr=1, xl=lower[free], xu=upper[free])
    initial = starting_points(lower, upper, algorithm.population, None, child(sequence, 0))[:, free]
    factory = getattr(import_module(f"pymoo.algorithms.{MODULES[algorithm.algorithm]}"), algorithm.algorithm)
    search = factory(pop_size=algorithm.population, sampling=initial, **algorithm.settings)
    state = int(np.random.default_rng(child(sequence, 1)).integers(2**31))
    search.setup(problem, termination=NoTermination(), seed=state)
    if algorithm.algorithm == "CMOPSO":
        _seed_elites(search)

    def whole(X: Array) -> Array:
        points = np.tile(lower, (len(X), 1))
        points[:, free] = X
        clipped: Array = np.clip(points, lower, upper)
        return clipped

    snapshots: list[Snapshot] = []
    used = 0
    while True:
        infills = search.ask()
        while budgets and used + len(infills) > budgets[0]:
            snapshots.append(_snapshot(search, whole, used))
            budgets.pop(0)
        if not budgets:
            return tuple(snapshots)
        F, violation = objectives(whole(infills.get("X")))
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


def _snapshot(search: Any, whole: Callable[[Array], Array], used: int) -> Snapshot:
    feasible = search.opt[search.opt.get("FEAS")[:, 0]]
    problem = search.problem
    return Snapshot(
        evaluations=used,
        X=whole(feasible.get("X").astype(float).reshape(len(feasible), problem.n_var)),
        F=feasible.get("F").astype(float).reshape(len(feasible), problem.n_obj),
    )
