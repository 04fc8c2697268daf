"""Minimisation of several objectives at once, by algorithms of the package pymoo.

snapshots = minimize_many(objectives, make_front_algorithm("NSGA2"), evaluations=(1_000, 10_000), seed=1)
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Protocol

import numpy as np

from metaheuristics.adapters.pymoo import PymooSettings
from metaheuristics.errors import SearchError
from metaheuristics.interface import Array, Bounded
from metaheuristics.preparation import fill_fixed, prepare_start
from metaheuristics.registry import make_by_name


class ManyObjectives(Bounded, Protocol):
    """Objectives to be minimised within bounds, called on many points at once."""

    @property
    def count(self) -> int:
        """Number of objectives, m."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Objectives (P, m), finite and all of comparable size, and total violations (P,) of points (P, n)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MultiObjective(PymooSettings):
    """An algorithm of pymoo for several objectives.

    It is ``"NSGA2"`` or ``"CMOPSO"``; a population of 100 is pymoo's own choice.

    Source:
        Deb et al. (2002), NSGA-II; Zhang et al. (2018), A competitive mechanism based multi-objective particle swarm
        optimizer with fast convergence.
    """

    population: int = 100
    modules: ClassVar[Mapping[str, str]] = {"NSGA2": "moo.nsga2", "CMOPSO": "moo.cmopso"}

    @property
    def name(self) -> str:
        """The algorithm's."""
        return self.algorithm


FRONT_ALGORITHMS: Mapping[str, Callable[..., MultiObjective]] = {
    name: partial(MultiObjective, algorithm=name) for name in MultiObjective.modules
}
"""Algorithms by name; `pip install 'nlp-gait[algorithms]'` installs pymoo, which they need."""


def make_front_algorithm(name: str, /, **settings: object) -> MultiObjective:
    """Make an algorithm for several objectives by its name in `FRONT_ALGORITHMS`; raises SearchError as `make_algorithm` does."""
    return make_by_name("algorithm for several objectives", name, FRONT_ALGORITHMS, settings)


def check_budgets(algorithm: MultiObjective, evaluations: Sequence[int]) -> None:
    """Raise SearchError unless the budgets of snapshots rise and the first holds a generation."""
    budgets = list(evaluations)
    if not budgets or budgets != sorted(set(budgets)) or budgets[0] < algorithm.population:
        raise SearchError(
            f"evaluations must rise and begin with at least the population of {algorithm.population}, got {budgets}"
        )


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Snapshot:
    """Feasible points of a run that no other point of its population betters in all objectives."""

    evaluations: int  #: used until then
    X: Array  #: (k, n) points; none as long as the population has no feasible one
    F: Array  #: (k, m) objectives


def minimize_many(
    objectives: ManyObjectives,
    algorithm: MultiObjective,
    *,
    evaluations: Sequence[int] = (10_000,),
    seed: int = 0,
) -> tuple[Snapshot, ...]:
    """Run an algorithm once and take a snapshot at each budget, which equals a run of that budget.

    Args:
        objectives: what to minimise.
        algorithm: settings.
        evaluations: budgets, rising; each at least the population. Only whole generations are run.
        seed: of starting points and search; equal seeds start alike whatever the algorithm.

    Returns:
        A snapshot for each budget.

    Raises:
        SearchError: an argument is not allowed, all variables are fixed, or an objective is not finite.
    """
    check_budgets(algorithm, evaluations)
    start = prepare_start(objectives, algorithm.population, evaluations[-1], seed)
    if not (start.upper > start.lower).any():
        raise SearchError("all variables are fixed, so there is no front; widen the bounds of one")
    search = algorithm.begin(start, objectives.count)
    if algorithm.algorithm == "CMOPSO":
        _seed_elites(search)

    snapshots: list[Snapshot] = []
    used = 0
    while True:
        individuals = search.ask()
        X = fill_fixed(individuals.get("X"), start.lower, start.upper)
        while used + len(X) > evaluations[len(snapshots)]:
            best = search.opt[search.opt.get("FEAS")[:, 0]]
            sizes = {"X": search.problem.n_var, "F": search.problem.n_obj}
            points, values = (best.get(name).astype(float).reshape(len(best), size) for name, size in sizes.items())
            snapshots.append(Snapshot(evaluations=used, X=fill_fixed(points, start.lower, start.upper), F=values))
            if len(snapshots) == len(evaluations):
                return tuple(snapshots)
        F, violation = objectives(X)
        if not np.all(np.isfinite(F)):
            raise SearchError("an objective is not finite; give a large finite number where it has no value")
        # A violation that is not finite counts as the worst.
        individuals.set("F", np.array(F), "G", np.nan_to_num(violation, nan=1e30, posinf=1e30)[:, None])
        for individual in individuals:
            individual.H, individual.evaluated = np.zeros(0), {"F", "G", "H"}
        search.tell(infills=individuals)
        used += len(X)


def _seed_elites(search: Any) -> None:
    """Seed the generator with which pymoo thins out CMOPSO's elites, so that equal seeds give equal runs."""
    tournament = search.elites.truncation.survival

    def truncate(members: Any, count: int) -> Any:
        return tournament.do(search.problem, members, n_survive=count, random_state=search.random_state)

    search.elites.truncation = truncate
