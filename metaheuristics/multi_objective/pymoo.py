"""NSGA-II and CMOPSO of the package pymoo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.adapters.pymoo import FRONT_MODULES, PymooSettings
from metaheuristics.interface import Array, Start
from metaheuristics.preparation import fill_fixed


@dataclass(frozen=True, kw_only=True, slots=True)
class MultiObjective(PymooSettings):
    """An algorithm of pymoo for several objectives, ``"NSGA2"`` or ``"CMOPSO"``; a population of 100 is pymoo's own choice.

    Source:
        Deb et al. (2002), NSGA-II; Zhang et al. (2018), A competitive mechanism based multi-objective particle swarm
        optimizer with fast convergence.
    """

    population: int = 100
    modules: ClassVar[Mapping[str, str]] = FRONT_MODULES

    @property
    def name(self) -> str:
        """The algorithm's."""
        return self.algorithm

    def start(self, start: Start, objectives: int) -> PymooFrontSearch:
        search = self.begin(start, objectives)
        if self.algorithm == "CMOPSO":
            _seed_elites(search)
        return PymooFrontSearch(search, start)


class PymooFrontSearch:
    """A run of pymoo's; see `FrontSearch`."""

    def __init__(self, search: Any, start: Start) -> None:
        self._search, self._start = search, start
        self._infills: Any = None

    def ask(self) -> Array:
        self._infills = self._search.ask()
        return fill_fixed(self._infills.get("X"), self._start.lower, self._start.upper)

    def tell(self, X: Array, F: Array, violation: Array) -> None:
        self._infills.set("F", np.array(F), "G", violation[:, None])
        for individual in self._infills:
            individual.H, individual.evaluated = np.zeros(0), {"F", "G", "H"}
        self._search.tell(infills=self._infills)

    def front(self) -> tuple[Array, Array]:
        search, start = self._search, self._start
        feasible = search.opt[search.opt.get("FEAS")[:, 0]]
        problem = search.problem
        X = fill_fixed(feasible.get("X").astype(float).reshape(len(feasible), problem.n_var), start.lower, start.upper)
        return X, feasible.get("F").astype(float).reshape(len(feasible), problem.n_obj)


def _seed_elites(search: Any) -> None:
    """Seed the generator with which pymoo thins out CMOPSO's elites, so that equal seeds give equal runs."""
    tournament = search.elites.truncation.survival

    def truncate(members: Any, count: int) -> Any:
        return tournament.do(search.problem, members, n_survive=count, random_state=search.random_state)

    search.elites.truncation = truncate
