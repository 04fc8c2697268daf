"""Algorithms by name, for command lines and study files."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, TypeVar

from metaheuristics.adapters.pymoo import FRONT_MODULES, MODULES
from metaheuristics.constraint_handling import ConstraintHandling, Deb, EpsilonLevel, StaticPenalty
from metaheuristics.errors import SearchError, abbreviate
from metaheuristics.interface import Algorithm
from metaheuristics.settings import check_installed, is_installed

if TYPE_CHECKING:
    from metaheuristics.multi_objective.minimize_many import FrontAlgorithm

T = TypeVar("T", covariant=True)


class _Factories(Mapping[str, Callable[..., T]]):
    """Classes of settings by name; each module is imported when its class is first used."""

    def __init__(self, paths: Mapping[str, str]) -> None:
        self._paths = paths

    def __getitem__(self, name: str) -> Callable[..., T]:
        module, _, kind = self._paths[name].partition(":")
        factory: Callable[..., T] = getattr(import_module(f"metaheuristics.{module}"), kind)
        return partial(factory, algorithm=name.removeprefix("pymoo:")) if module.endswith("pymoo") else factory

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)


ALGORITHMS: Mapping[str, Callable[..., Algorithm]] = _Factories(
    {
        "pso": "algorithms.particle_swarm:ParticleSwarm",
        "pso-constant": "algorithms.particle_swarm:ConstantInertiaSwarm",
        "ga": "algorithms.genetic:GeneticAlgorithm",
        "aco": "algorithms.ant_colony:AntColony",
        "aco-grid": "algorithms.ant_colony:AntColonyGrid",
        "de": "algorithms.differential_evolution:DifferentialEvolution",
        "lshade": "algorithms.differential_evolution:LShade",
        "random": "algorithms.random_search:RandomSearch",
        "sobol": "algorithms.random_search:SobolPoints",
    }
)
"""This package's own algorithms."""

ADAPTERS: Mapping[str, Callable[..., Algorithm]] = _Factories(
    {
        "cma": "adapters.cma:CmaEs",
        "cma-al": "adapters.cma:CmaLagrangian",
        "bayes": "adapters.egobox:BayesianOptimisation",
        "scipy:SLSQP": "adapters.many_starts:SlsqpStarts",
        "scipy:COBYQA": "adapters.many_starts:CobyqaStarts",
        **{f"pymoo:{name}": "adapters.pymoo:Pymoo" for name in MODULES},
    }
)
"""Those of other packages: `pip install 'nlp-gait[algorithms]'` installs them, and `'nlp-gait[bayes]'` that of `bayes`."""

FRONT_ALGORITHMS: Mapping[str, Callable[..., FrontAlgorithm]] = _Factories(
    {
        **{name: "multi_objective.pymoo:MultiObjective" for name in FRONT_MODULES},
        "CMOEAD": "multi_objective.constrained_moead:ConstrainedMoead",
        "DCNSGA3": "multi_objective.dynamic_nsga3:DynamicConstrainedNsga3",
    }
)
"""Those for several objectives; all use operators of pymoo, which `pip install 'nlp-gait[algorithms]'` installs."""

PACKAGES = {"cma-al": "cma", "bayes": "egobox"}  # of adapters whose names do not begin with the package's

HANDLINGS: Mapping[str, Callable[..., ConstraintHandling]] = {
    "deb": Deb,
    "penalty": StaticPenalty,
    "epsilon": EpsilonLevel,
}


def algorithm(name: str, /, **settings: object) -> Algorithm:
    """Make an algorithm by name.

    Args:
        name: A key of `ALGORITHMS` or `ADAPTERS`.
        settings: Settings that differ from the defaults.

    Raises:
        SearchError: Unknown name or setting (the nearest known ones are suggested), a value that is not allowed, or the
            package that it comes from is not installed.
    """
    if isinstance(name, str) and name in ADAPTERS:
        check_installed(name, _package(name))
    return make_by_name("algorithm", name, {**ALGORITHMS, **ADAPTERS}, settings)


def installed_algorithms() -> tuple[str, ...]:
    """Names of the algorithms that can run here: this package's own, and those whose package is installed."""
    return (*ALGORITHMS, *(name for name in ADAPTERS if is_installed(_package(name))))


def _package(name: str) -> str:
    return PACKAGES.get(name, name.partition(":")[0])


def handling(name: str, /, **settings: object) -> ConstraintHandling:
    """Make a constraint handling by its name in `HANDLINGS`; raises SearchError as `algorithm` does."""
    return make_by_name("constraint handling", name, HANDLINGS, settings)


def make_by_name(kind: str, name: str, factories: Mapping[str, Callable[..., T]], settings: Mapping[str, object]) -> T:
    """Call the factory of that name with settings; raises SearchError as `algorithm` does."""
    if not isinstance(name, str):
        raise SearchError(
            f"the name of {'an' if kind[0] in 'aeiou' else 'a'} {kind} must be a text, got {abbreviate(name)}"
        )
    if name not in factories:
        raise SearchError(f"unknown {kind} {name!r}; {_suggest(name, factories)}")
    factory = factories[name]
    known = inspect.signature(factory).parameters
    for setting in settings:
        if setting not in known:
            raise SearchError(f"{kind} {name!r} has no setting {setting!r}; {_suggest(setting, known)}")
    for setting, parameter in known.items():
        if parameter.default is parameter.empty and setting not in settings:
            raise SearchError(f"{kind} {name!r} needs a value for {setting!r}")
    return factory(**settings)


def front_algorithm(name: str, /, **settings: object) -> FrontAlgorithm:
    """Make an algorithm for several objectives by its name in `FRONT_ALGORITHMS`; raises SearchError as `algorithm` does."""
    return make_by_name("algorithm for several objectives", name, FRONT_ALGORITHMS, settings)


def _suggest(word: str, known: Iterable[str]) -> str:
    """Say which known words are near, and name all."""
    names = list(known)
    near = difflib.get_close_matches(word, names)
    meant = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"{meant}Known: {', '.join(names)}"
