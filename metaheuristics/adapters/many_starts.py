"""Local solvers of SciPy, restarted from random points until the budget ends."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.interface import UNKNOWN, Array, CallingSearch, Evaluate, Start
from metaheuristics.preparation import UnitCube
from metaheuristics.settings import check_count, check_number

DIFFERENCE = 1.5e-8  # of forward differences, as a share of each variable's range: the root of the machine's precision


@dataclass(frozen=True, kw_only=True, slots=True)
class ScipyStarts:
    """Base of the local solvers of SciPy: starts, and how they see the constraints.

    Where the objective cannot separate its constraints, the total violation is the only one. The constraint handling of the
    study is not used.
    """

    population: int = 1  #: starting points, which all searches share; further starts are drawn uniformly
    #: tightens each constraint, in units of its scale: a solver stops slightly outside its constraints, which a search counts
    #: as infeasible. Not applied to the total violation, which has no inside
    margin: float = 1e-7
    iterations: int = 1000  #: limit for one start
    name: ClassVar[str]

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)
        check_number(self, "margin", at_least=0.0)
        check_count(self, "iterations", at_least=1)

    def start(self, start: Start) -> "_ScipyStartsSearch":
        return _ScipyStartsSearch(self, start)


@dataclass(frozen=True, kw_only=True, slots=True)
class SlsqpStarts(ScipyStarts):
    """SciPy's SLSQP from many starts, with forward differences that count as evaluations.

    It sees every row of the constraints, as they are smooth.

    Source:
        Kraft (1988), A software package for sequential quadratic programming, as in `scipy.optimize.minimize`.
    """

    name: ClassVar[str] = "scipy:SLSQP"


@dataclass(frozen=True, kw_only=True, slots=True)
class CobyqaStarts(ScipyStarts):
    """SciPy's COBYQA from many starts: quadratic models within a trust region, without derivatives.

    It models each constraint's worst row: with hundreds of rows, each with a model of its own, a step would take seconds.

    Source:
        Ragonneau (2022), Model-based derivative-free optimization methods and software, as in `scipy.optimize.minimize`.
    """

    name: ClassVar[str] = "scipy:COBYQA"


class _Functions:
    """Objective and constraints of single points in the unit cube of the free variables; each is evaluated once."""

    def __init__(self, start: Start, settings: ScipyStarts, evaluate: Evaluate) -> None:
        self._start, self._margin, self._evaluate = start, settings.margin, evaluate
        self._by_row = isinstance(settings, SlsqpStarts)
        self.cube = UnitCube(start)
        self._at: tuple[bytes, float, Array] = (b"", 0.0, np.empty(0))
        self._slope: tuple[bytes, Array, Array] = (b"", np.empty(0), np.empty((0, 0)))

    def at(self, z: Array) -> tuple[float, Array]:
        """Return the objective and the constraint values (m,)."""
        key = z.tobytes()
        if self._at[0] != key:
            f, values = self._values(z[None])
            self._at = key, float(f[0]), values[0]
        return self._at[1], self._at[2]

    def slope(self, z: Array) -> tuple[Array, Array]:
        """Return forward differences: gradient (k,) of the objective and Jacobian (m, k) of the constraint values."""
        key = z.tobytes()
        if self._slope[0] != key:
            f, values = self.at(z)
            step = np.where(z + DIFFERENCE <= 1.0, DIFFERENCE, -DIFFERENCE)
            shifted_f, shifted = self._values(z + np.diag(step))
            self._slope = key, (shifted_f - f) / step, ((shifted - values) / step[:, None]).T
        return self._slope[1], self._slope[2]

    def _values(self, Z: Array) -> tuple[Array, Array]:
        X = self.cube.points(np.clip(Z, 0.0, 1.0))
        f, violation, _ = self._evaluate(X)
        constraints = self._start.constraints
        if constraints is None:  # COBYQA treats exactly zero as a binding constraint
            met = 0.0 if self._by_row else -1.0
            values = np.where(violation > 0.0, violation, met)[:, None]
        else:
            values = constraints.inequalities(X) if self._by_row else constraints.worst(X)
            values = values + self._margin
        finite = np.clip(np.nan_to_num(values, nan=UNKNOWN, posinf=UNKNOWN, neginf=-UNKNOWN), -UNKNOWN, UNKNOWN)
        return np.minimum(f, UNKNOWN), finite


class _ScipyStartsSearch(CallingSearch):
    def __init__(self, settings: ScipyStarts, start: Start) -> None:
        self._settings, self._start = settings, start

    def run(self, evaluate: Evaluate) -> str:
        from scipy.optimize import NonlinearConstraint, minimize

        functions = _Functions(self._start, self._settings, evaluate)
        cube, iterations = functions.cube, self._settings.iterations
        if not cube.size:
            evaluate(np.array(self._start.initial))
            return "all variables are fixed"
        how: dict[str, Any]
        if isinstance(self._settings, SlsqpStarts):
            rows = {"fun": lambda z: -functions.at(z)[1], "jac": lambda z: -functions.slope(z)[1]}
            how = {"jac": lambda z: functions.slope(z)[0], "constraints": {"type": "ineq", **rows}}
            how["options"] = {"maxiter": iterations, "ftol": 1e-10}
        else:
            inequalities = NonlinearConstraint(lambda z: functions.at(z)[1], -np.inf, 0.0)
            how = {"constraints": inequalities, "options": {"maxiter": iterations}}
        how |= {"method": self._settings.name.removeprefix("scipy:"), "bounds": [(0.0, 1.0)] * cube.size}
        starts = iter(self._start.initial)
        while True:
            x0 = next(starts, None)
            z0 = self._start.rng.random(cube.size) if x0 is None else cube.shares(x0)
            minimize(lambda z: functions.at(z)[0], z0, **how)
