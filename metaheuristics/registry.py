"""Algorithms by name, for command lines and study files."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from metaheuristics.ant_colony import AntColony
from metaheuristics.ant_colony_grid import AntColonyGrid
from metaheuristics.errors import SearchError
from metaheuristics.genetic import GeneticAlgorithm
from metaheuristics.interface import Algorithm
from metaheuristics.particle_swarm import ParticleSwarm

ALGORITHMS: Mapping[str, Callable[..., Algorithm]] = MappingProxyType(
    {factory.name: factory for factory in (ParticleSwarm, GeneticAlgorithm, AntColony, AntColonyGrid)}
)


def algorithm(name: str, **settings: object) -> Algorithm:
    """Make an algorithm by name.

    Args:
        name: A key of `ALGORITHMS`.
        settings: Settings that differ from the defaults.

    Returns:
        The algorithm.

    Raises:
        SearchError: Unknown name or setting (the nearest known ones are suggested), or a value that is not allowed.
    """
    if name not in ALGORITHMS:
        raise SearchError(f"unknown algorithm {name!r}; {_suggest(name, ALGORITHMS)}")
    factory = ALGORITHMS[name]
    known = inspect.signature(factory).parameters
    for setting in settings:
        if setting not in known:
            raise SearchError(f"algorithm {name!r} has no setting {setting!r}; {_suggest(setting, known)}")
    return factory(**settings)


def _suggest(word: str, known: Iterable[str]) -> str:
    """Say which known words are near, and name all."""
    names = list(known)
    near = difflib.get_close_matches(word, names)
    meant = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return f"{meant}Known: {', '.join(names)}"
