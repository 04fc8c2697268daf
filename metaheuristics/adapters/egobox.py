"""Bayesian optimisation by the package egobox, for budgets of a few hundred evaluations."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import UnitCube
from metaheuristics.settings import check_count, check_installed

MOST = 500  # evaluations: each new point fits a Gaussian process to each constraint, through all points


@dataclass(frozen=True, kw_only=True, slots=True)
class BayesianOptimisation:
    """Bayesian optimisation: Gaussian processes of the objective and of each constraint say where to look next.

    egobox's own settings: the logarithm of expected improvement within the constraints' predicted means. Each constraint is
    its worst row, modelled as sign(c) ln(1 + |c|), as it spans many powers of ten. The constraint handling of the study
    is not used. After 500 evaluations it stops: fitting takes longer with every point.

    Source:
        Lafage (2022), egobox, a Rust toolbox for efficient global optimization; Jones, Schonlau, Welch (1998), Efficient
        global optimization of expensive black-box functions; the transform of constraints after Eriksson, Poloczek (2021),
        Scalable constrained Bayesian optimization.
    """

    population: int = 20  #: points evaluated before the first model; 20 are about two for each of 9 variables
    name: ClassVar[str] = "bayes"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=3, at_most=MOST)
        check_installed(self.name, "egobox")

    def start(self, start: Start) -> "BayesianSearch":
        return BayesianSearch(self, start)


class BayesianSearch(PopulationSearch[BayesianOptimisation]):
    """A run of `BayesianOptimisation`; see `Search`. egobox works in the unit cube of the free variables."""

    def __init__(self, settings: BayesianOptimisation, start: Start) -> None:
        super().__init__(settings, start)
        self._cube = UnitCube(start)
        self._known = np.empty((0, self._cube.size))
        self._values: Array | None = None
        self._model: Any = None

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        if not self._cube.size:
            return
        inequalities = self._start.inequalities(X, violation)
        values = np.column_stack([f, np.sign(inequalities) * np.log1p(np.abs(inequalities))])
        worked = np.isfinite(f)  # egobox does not see failed evaluations
        self._known = np.concatenate([self._known, self._cube.shares(X)[worked]])
        self._values = values[worked] if self._values is None else np.concatenate([self._values, values[worked]])
        self._X = self._cube.points(self._suggest())

    def stop(self) -> tuple[str, ...]:
        if not self._cube.size:
            return ("all variables are fixed",)
        return (f"fitting to more than {MOST} points takes too long",) if len(self._known) >= MOST else ()

    def _suggest(self) -> Array:
        """Return the most promising point (1, k); a random one while there is too little to fit."""
        values = self._values
        if values is None or len(values) < self._settings.population or not np.ptp(values[:, 0]) > 0.0:
            return self._start.rng.random((1, self._cube.size))
        if self._model is None:
            from egobox import CstrSpec, Egor

            cube = np.tile([0.0, 1.0], (self._cube.size, 1))
            self._model = Egor(cube, cstr_specs=[CstrSpec.leq(0.0)] * (values.shape[1] - 1))
        seed = int(self._start.rng.integers(2**31))
        suggested: Array = np.asarray(self._model.suggest(self._known, values, seed=seed), dtype=float)
        return np.clip(suggested, 0.0, 1.0)
