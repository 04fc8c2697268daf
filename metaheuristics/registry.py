"""Algorithms by name, for command lines and study files."""

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import TypeVar

from metaheuristics.adapters.cma import CmaEs
from metaheuristics.adapters.pymoo import MODULES, Pymoo
from metaheuristics.algorithms.ant_colony import AntColony, AntColonyGrid
from metaheuristics.algorithms.differential_evolution import DifferentialEvolution
from metaheuristics.algorithms.genetic import GeneticAlgorithm, GoswamiGeneticAlgorithm
from metaheuristics.algorithms.particle_swarm import ConstantInertiaSwarm, ParticleSwarm
from metaheuristics.algorithms.random_search import RandomSearch
from metaheuristics.errors import SearchError, abbreviate, check_installed, is_installed
from metaheuristics.interface import Algorithm, ConstraintHandling, Deb, StaticPenalty

T = TypeVar("T")


ALGORITHMS: Mapping[str, Callable[..., Algorithm]] = {
    "pso": ParticleSwarm,
    "pso-constant": ConstantInertiaSwarm,
    "ga": GeneticAlgorithm,
    "ga-goswami": GoswamiGeneticAlgorithm,
    "aco": AntColony,
    "aco-grid": AntColonyGrid,
    "de": DifferentialEvolution,
    "random": RandomSearch,
}
"""This package's own algorithms."""

ADAPTERS: Mapping[str, Callable[..., Algorithm]] = {
    "cma": CmaEs,
    **{f"pymoo:{name}": partial(Pymoo, algorithm=name) for name in MODULES},
}
"""Those of other packages, by the package's name and a colon: `pip install 'nlp-gait[algorithms]'` installs them."""


def make_algorithm(name: str, /, **settings: object) -> Algorithm:
    """Make an algorithm by name.

    Args:
        name: A key of `ALGORITHMS` or `ADAPTERS`.
        settings: Settings that differ from the defaults.

    Raises:
        SearchError: Unknown name or setting (the nearest known ones are suggested), a value that is not allowed, or the
            package that it comes from is not installed.
    """
    if isinstance(name, str) and name in ADAPTERS:
        check_installed(name, name.partition(":")[0])
    return make_by_name("algorithm", name, {**ALGORITHMS, **ADAPTERS}, settings)


def list_installed_algorithms() -> tuple[str, ...]:
    """Names of the algorithms that can run here: this package's own, and those whose package is installed."""
    return (*ALGORITHMS, *(name for name in ADAPTERS if is_installed(name.partition(":")[0])))


def make_handling(text: str, /) -> ConstraintHandling:
    """Make a constraint handling from `deb` or `penalty=WEIGHT`; raises SearchError for another text."""
    if isinstance(text, str) and text == "deb":
        return Deb()
    if isinstance(text, str) and text.startswith("penalty="):
        with suppress(ValueError):
            return StaticPenalty(weight=float(text.removeprefix("penalty=")))
    allowed = "deb or penalty=WEIGHT, a number > 0; no weight suits every problem"
    raise SearchError(f"constraint handling must be {allowed}, got {abbreviate(text)}")


def make_by_name(kind: str, name: str, factories: Mapping[str, Callable[..., T]], settings: Mapping[str, object]) -> T:
    """Call the factory of that name with settings; raises SearchError as `make_algorithm` does."""
    if not isinstance(name, str):
        raise SearchError(
            f"the name of {'an' if kind[0] in 'aeiou' else 'a'} {kind} must be a text, got {abbreviate(name)}"
        )
    if name not in factories:
        raise SearchError(f"unknown {kind} {name!r}; {_suggest(name, factories)}")
    factory = factories[name]
    parameters = inspect.signature(factory).parameters
    for setting in settings:
        if setting not in parameters:
            raise SearchError(f"{kind} {name!r} has no setting {setting!r}; {_suggest(setting, parameters)}")
    for setting, parameter in parameters.items():
        if parameter.default is parameter.empty and setting not in settings:
            raise SearchError(f"{kind} {name!r} needs a value for {setting!r}")
    return factory(**settings)


def _suggest(word: str, known: Iterable[str]) -> str:
    """Say which known words are near, and name all."""
    names = list(known)
    near = difflib.get_close_matches(word, names)
    meant = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"{meant}Known: {', '.join(names)}"
