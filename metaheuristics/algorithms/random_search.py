"""Random search and Sobol points: the baselines that every other algorithm has to beat."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import UnitCube
from metaheuristics.settings import check_count


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


@dataclass(frozen=True, kw_only=True, slots=True)
class SobolPoints:
    """Points of a scrambled Sobol sequence over the variables that are free; nothing is learned.

    Source:
        Sobol (1967), On the distribution of points in a cube; Owen (1998), Scrambling Sobol and Niederreiter-Xing points;
        as in `scipy.stats.qmc.Sobol`.
    """

    population: int = 1  #: starting points, which all searches share, before the sequence begins
    batch: int = 64  #: points of the sequence asked for at once
    name: ClassVar[str] = "sobol"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)
        check_count(self, "batch", at_least=1)

    def start(self, start: Start) -> "_SobolRun":
        return _SobolRun(self, start)


class _SobolRun(PopulationSearch[SobolPoints]):
    def __init__(self, settings: SobolPoints, start: Start) -> None:
        from scipy.stats.qmc import Sobol

        super().__init__(settings, start)
        self._cube = UnitCube(start)
        seed = int(start.rng.integers(2**31))
        self._sequence = Sobol(self._cube.size, seed=np.random.default_rng(seed)) if self._cube.size else None

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        if self._sequence is not None:
            self._X = self._cube.points(self._sequence.random(self._settings.batch))

    def stop(self) -> tuple[str, ...]:
        return ("all variables are fixed",) if self._sequence is None else ()
