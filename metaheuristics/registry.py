"""Algorithms by name, for command lines and study files."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

from metaheuristics.adapters.cma import CmaEs
from metaheuristics.adapters.cma_lagrangian import CmaLagrangian
from metaheuristics.adapters.egobox import BayesianOptimisation
from metaheuristics.adapters.many_starts import CobyqaStarts, SlsqpStarts
from metaheuristics.adapters.pymoo import MODULES, Pymoo
from metaheuristics.algorithms.ant_colony import AntColony
from metaheuristics.algorithms.ant_colony_grid import AntColonyGrid
from metaheuristics.algorithms.differential_evolution import DifferentialEvolution
from metaheuristics.algorithms.genetic import GeneticAlgorithm
from metaheuristics.algorithms.lshade import LShade
from metaheuristics.algorithms.particle_swarm import ParticleSwarm
from metaheuristics.algorithms.random_search import RandomSearch
from metaheuristics.algorithms.sobol import SobolPoints
from metaheuristics.constraint_handling import ConstraintHandling, Deb, EpsilonLevel, StaticPenalty
from metaheuristics.errors import SearchError, shown
from metaheuristics.interface import Algorithm
from metaheuristics.settings import check_installed, is_installed

T = TypeVar("T")

ALGORITHMS: Mapping[str, Callable[..., Algorithm]] = MappingProxyType(
    {
        factory.name: factory
        for factory in (
            ParticleSwarm,
            GeneticAlgorithm,
            AntColony,
            AntColonyGrid,
            DifferentialEvolution,
            LShade,
            RandomSearch,
            SobolPoints,
        )
    }
)
"""This package's own algorithms."""

_SINGLE: Mapping[str, Callable[..., Any]] = {  # SciPy's are not asked: they call
    "cma": CmaEs,
    "cma-al": CmaLagrangian,
    "bayes": BayesianOptimisation,
    "scipy:SLSQP": SlsqpStarts,
    "scipy:COBYQA": CobyqaStarts,
}
ADAPTERS: Mapping[str, Callable[..., Algorithm]] = MappingProxyType(
    {**_SINGLE, **{f"pymoo:{name}": partial(Pymoo, algorithm=name) for name in MODULES}}
)
"""Those of other packages: `pip install 'nlp-gait[algorithms]'` installs them, and `'nlp-gait[bayes]'` that of `bayes`."""

PACKAGES = {"cma-al": "cma", "bayes": "egobox"}  # of adapters whose names do not begin with the package's

HANDLINGS: Mapping[str, Callable[..., ConstraintHandling]] = MappingProxyType(
    {"deb": Deb, "penalty": StaticPenalty, "epsilon": EpsilonLevel}
)


def algorithm(name: str, /, **settings: object) -> Algorithm:
    """Make an algorithm by name.

    Args:
        name: A key of `ALGORITHMS` or `ADAPTERS`.
        settings: Settings that differ from the defaults.

    Returns:
        The algorithm.

    Raises:
        SearchError: Unknown name or setting (the nearest known ones are suggested), a value that is not allowed, or the
            package that it comes from is not installed.
    """
    if isinstance(name, str) and name in ADAPTERS:
        check_installed(name, _package(name))
    return made("algorithm", name, {**ALGORITHMS, **ADAPTERS}, settings)


def installed_algorithms() -> tuple[str, ...]:
    """Names of the algorithms that can run here: this package's own, and those whose package is installed."""
    return (*ALGORITHMS, *(name for name in ADAPTERS if is_installed(_package(name))))


def _package(name: str) -> str:
    return PACKAGES.get(name, name.partition(":")[0])


def handling(name: str, /, **settings: object) -> ConstraintHandling:
    """Make a constraint handling by name.

    Args:
        name: A key of `HANDLINGS`.
        settings: Settings that differ from the defaults.

    Raises:
        SearchError: Unknown name or setting, a setting that is missing, or a value that is not allowed.
    """
    return made("constraint handling", name, HANDLINGS, settings)


def made(kind: str, name: str, factories: Mapping[str, Callable[..., T]], settings: Mapping[str, object]) -> T:
    """What a factory makes of settings, by its name; SearchError as `algorithm` raises it."""
    if not isinstance(name, str):
        raise SearchError(f"the name of {'an' if kind[0] in 'aeiou' else 'a'} {kind} must be a text, got {shown(name)}")
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


def _suggest(word: str, known: Iterable[str]) -> str:
    """Say which known words are near, and name all."""
    names = list(known)
    near = difflib.get_close_matches(word, names)
    meant = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"{meant}Known: {', '.join(names)}"
