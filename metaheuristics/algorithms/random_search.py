"""Random search: the baseline that every other algorithm has to beat."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.errors import check_count
from metaheuristics.interface import Array, PopulationSearch, Rule, Start


@dataclass(frozen=True, kw_only=True, slots=True)
class RandomSearch:
    """Points drawn uniformly within the bounds; nothing is learned."""

    population: int = 50  #: Points of one batch
    name: ClassVar[str] = "random"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)

    def start(self, start: Start) -> "_RandomSearchRun":
        return _RandomSearchRun(self, start)


class _RandomSearchRun(PopulationSearch[RandomSearch]):
    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        start = self._start
        width = start.upper - start.lower
        self._X = np.clip(start.lower + start.rng.random(start.initial.shape) * width, start.lower, start.upper)
