"""Uniform random search: what every other algorithm has to beat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import PopulationSearch, Start
from metaheuristics.settings import check_count


@dataclass(frozen=True, kw_only=True, slots=True)
class RandomSearch:
    """Points drawn uniformly within the bounds; nothing is learned.

    Attributes:
        population: Points of one batch.

    Raises:
        SearchError: A setting is not allowed.
    """

    population: int = 50
    name: ClassVar[str] = "random"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)

    def start(self, start: Start) -> RandomSearchRun:
        """Begin a run; see `Algorithm.start`."""
        return RandomSearchRun(self, start)


class RandomSearchRun(PopulationSearch[RandomSearch]):
    """A run of `RandomSearch`; see `Search`."""

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        """Draw the next points; see `Search.tell`."""
        start = self._start
        width = start.upper - start.lower
        self._X = np.clip(start.lower + start.rng.random(start.initial.shape) * width, start.lower, start.upper)
