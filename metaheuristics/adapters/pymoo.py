"""Any population-based algorithm of the package pymoo."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from metaheuristics.errors import SearchError, bad_setting, check_count, check_installed
from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import fill_fixed

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
