"""Any population-based algorithm of the package pymoo, and NSGA-II and CMOPSO for several objectives."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from metaheuristics.errors import SearchError
from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import fill_fixed
from metaheuristics.settings import bad_setting, check_count, check_installed

MODULES: Mapping[str, str] = {
    "DE": "soo.nonconvex.de",
    "EPPSO": "soo.nonconvex.pso_ep",
    "ES": "soo.nonconvex.es",
    "G3PCX": "soo.nonconvex.g3pcx",
    "GA": "soo.nonconvex.ga",
    "ISRES": "soo.nonconvex.isres",
    "NRBO": "soo.nonconvex.nrbo",
    "PSO": "soo.nonconvex.pso",
    "SRES": "soo.nonconvex.sres",
}
FRONT_MODULES: Mapping[str, str] = {"NSGA2": "moo.nsga2", "CMOPSO": "moo.cmopso"}


@dataclass(frozen=True, kw_only=True, slots=True)
class PymooSettings:
    """An algorithm of pymoo with its own defaults, started from the starting points.

    Source:
        Blank, Deb (2020), pymoo: Multi-objective optimization in Python.
    """

    algorithm: str  #: Class name in pymoo, for example "GA"
    population: int = 50  #: Size of the population (pop_size)
    settings: Mapping[str, Any] = field(default_factory=dict)  #: Further arguments of the class
    modules: ClassVar[Mapping[str, str]]  #: Where pymoo has the classes that are allowed

    def __post_init__(self) -> None:
        if self.algorithm not in self.modules:
            raise bad_setting(self, "algorithm", f"one of {', '.join(self.modules)}")
        check_count(self, "population", at_least=5)
        check_installed(self.algorithm, "pymoo")

    def begin(self, start: Start, objectives: int = 1) -> Any:
        """Begin pymoo's own search of the free variables; raises SearchError if it does not take the settings."""
        from pymoo.core.problem import Problem
        from pymoo.core.termination import NoTermination

        free = start.upper > start.lower
        lower, upper = start.lower[free], start.upper[free]
        problem = Problem(n_var=len(lower), n_obj=objectives, n_ieq_constr=1, xl=lower, xu=upper)
        factory = getattr(import_module(f"pymoo.algorithms.{self.modules[self.algorithm]}"), self.algorithm)
        try:
            search = factory(pop_size=self.population, sampling=start.initial[:, free], **self.settings)
        except TypeError as error:
            raise SearchError(f"pymoo:{self.algorithm} does not take these settings: {error}") from error
        search.setup(problem, termination=NoTermination(), seed=int(start.rng.integers(2**31)))
        if getattr(search, "survival", None) is not None:  # SRES and ISRES call it without a source of random numbers
            search.survival.do = partial(search.survival.do, random_state=search.random_state)
        return search


@dataclass(frozen=True, kw_only=True, slots=True)
class Pymoo(PymooSettings):
    """An algorithm of pymoo for one objective.

    pymoo prefers feasible points by itself, as Deb's rules do. It is given the objective and the violation as the
    constraint rule in force sees them, for its whole population again in each generation.
    """

    modules: ClassVar[Mapping[str, str]] = MODULES

    @property
    def name(self) -> str:
        """For example ``"pymoo:GA"``."""
        return f"pymoo:{self.algorithm}"

    def start(self, start: Start) -> "PymooSearch":
        return PymooSearch(self, start)


class PymooSearch(PopulationSearch[Pymoo]):
    """A run of `Pymoo` on the free variables; see `Search`."""

    def __init__(self, settings: Pymoo, start: Start) -> None:
        super().__init__(settings, start)
        self._algorithm: Any = None
        if (start.upper > start.lower).any():
            self._algorithm = settings.begin(start)
            self._infills = self._algorithm.ask()

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        if self._algorithm is None:
            return
        for individual, values in zip(self._infills, zip(f, violation, strict=True), strict=True):
            individual.data["raw"] = values
        members = () if self._algorithm.pop is None else self._algorithm.pop
        members = [individual for individual in members if "raw" in individual.data]
        individuals = [*members, *self._infills]
        raw = np.array([individual.data["raw"] for individual in individuals])
        violations, objectives = rule.keys(raw[:, 0], raw[:, 1])
        # Finite, for the sums and differences that some algorithms take: failed evaluations still come last.
        finite = (np.nan_to_num(values, posinf=1e30) for values in (objectives, violations))
        for individual, value, violated_by in zip(individuals, *finite, strict=True):
            individual.F, individual.G, individual.H = np.array([value]), np.array([violated_by]), np.zeros(0)
            individual.evaluated = {"F", "G", "H"}
        self._algorithm.tell(infills=self._infills)
        self._infills = self._algorithm.ask()
        self._X = fill_fixed(self._infills.get("X"), self._start.lower, self._start.upper)

    def stop(self) -> tuple[str, ...]:
        return ("all variables are fixed",) if self._algorithm is None else ()


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

    def start(self, start: Start, objectives: int) -> "_PymooFrontSearch":
        search = self.begin(start, objectives)
        if self.algorithm == "CMOPSO":
            _seed_elites(search)
        return _PymooFrontSearch(search, start)


class _PymooFrontSearch:
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
