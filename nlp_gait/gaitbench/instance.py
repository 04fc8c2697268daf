"""An instance of the suite: one object with everything that an optimiser may ask for."""

from __future__ import annotations

import threading
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.kernel.kernel_source import Kernel, kernel_of
from nlp_gait.errors import InputError, check_name
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.adapters import check_installed
from nlp_gait.gaitbench.definitions import Definition, definition_of
from nlp_gait.gaitbench.known import Evidence, Known, known
from nlp_gait.gaitbench.problem import gaitbench

# What was built for an instance is shared by all threads, and built by one of them.
_BUILDING = threading.RLock()


class Sides:
    """Rows of a problem as one-sided ones, G <= 0 in units of each row's scale; the variables' bounds are not among them.

    Attributes:
        row: (m,) which row of the kernel each is made from.
        sign: (m,) +1 for an upper bound, -1 for a lower one.
        bound: (m,) [unit of the row].
        weight: (m,) 1 / scale.
        names: (m,) for example ``torque_change[LKneePitch, 3] <= upper``.
    """

    def __init__(self, kernel: Kernel, problem: GaitProblem) -> None:
        """Split every row with two finite bounds into two."""
        lower, upper = kernel.row_bounds(problem)
        own = len(lower) - len(problem.names)
        both = np.stack([lower[:own], upper[:own]], axis=1)
        self.row, side = (np.asarray(part) for part in np.nonzero(np.isfinite(both)))
        self.sign = np.where(side == 1, 1.0, -1.0)
        self.bound = both[self.row, side]
        self.weight = kernel.weights[self.row]
        words = (">= lower", "<= upper")
        self.names = tuple(f"{kernel.model.row_names[r]} {words[s]}" for r, s in zip(self.row, side, strict=True))

    def __call__(self, g: Array) -> Array:
        """(P, m) one-sided rows of the kernel's rows (P, ...)."""
        return np.asarray(self.sign * (g[:, self.row] - self.bound) * self.weight)


class Instance:
    """A frozen problem: minimise f(x) within bounds, subject to rows G(x) <= 0.

        f, violation = problem(X)

    It is picklable, and may be called from several threads and processes at once.

    Attributes:
        id: its name for good.
        definition: what it is made from.
        unit_cube: whether x runs from 0 to 1 instead of in physical units.
        names: (n,) variables.
        units: (n,) of the variables; all ``"1"`` in the unit cube.
        lower: (n,) bounds.
        upper: (n,).
        evidence: that ``best_known`` is the optimum; ``str()`` says it in words.
    """

    def __init__(self, id: str, *, unit_cube: bool = False) -> None:
        """Use ``gaitbench.load`` instead."""
        self.id = id
        self.unit_cube = unit_cube
        self.definition: Definition = definition_of(id)
        self.gait_problem: GaitProblem = gaitbench(instance=id)
        self.names = self.gait_problem.names
        self._origin, self._width = np.array(self.gait_problem.lower), np.array(self.gait_problem.upper)
        self._width -= self._origin
        if unit_cube:
            self.units: tuple[str, ...] = ("1",) * len(self.names)
            self.lower, self.upper = np.zeros(len(self.names)), np.ones(len(self.names))
        else:
            self.units = tuple(variable.unit for variable in self.gait_problem.variables)
            self.lower, self.upper = np.array(self.gait_problem.lower), np.array(self.gait_problem.upper)
        for array in (self.lower, self.upper):
            array.setflags(write=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Its id is enough to make it again."""
        return _again, (self.id, self.unit_cube)

    def __repr__(self) -> str:
        """For example ``<GaitBench ssp-v5: 9 variables, 744 rows>``."""
        return f"<GaitBench {self.id}: {len(self.names)} variables, {len(self.row_names)} rows>"

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Evaluate points.

        Args:
            X: (P, n) points, one a row.

        Returns:
            (P,) objective, to be minimised; and (P,) violation: the sum of all rows' positive parts and of what exceeds the
            bounds, in units of each scale, zero if and only if the point is feasible. Both are infinite where x is not finite.

        Raises:
            InputError: X has another shape, or is not made of numbers.
        """
        return self._objective(self._physical(X))

    def rows(self, X: Array) -> Array:
        """(P, m) rows G(X), met where <= 0, in units of each row's scale, named by ``row_names``; arguments as a call."""
        return self._sides(self._objective.constraints(self._physical(X)))

    def gradient(self, x: Array) -> Array:
        """(n,) gradient of the objective at x (n,); at a kink, of one of the pieces."""
        gradient, _ = self._derivatives(self._point(x), self.gait_problem.p)
        return np.array(gradient).ravel() * self._slope

    def jacobian(self, x: Array) -> Array:
        """(m, n) derivatives of the rows at x (n,); at a kink, of one of the pieces."""
        _, jacobian = self._derivatives(self._point(x), self.gait_problem.p)
        sides = self._sides
        return np.array(jacobian)[sides.row] * (sides.sign * sides.weight)[:, None] * self._slope

    @property
    def row_names(self) -> tuple[str, ...]:
        """(m,) names of the rows."""
        return self._sides.names

    @property
    def known(self) -> Known:
        """All that is known of it."""
        return known()[self.id]

    @property
    def best_known(self) -> float:
        """Least feasible objective known, in the sense of minimisation."""
        return self.known.best_known

    @property
    def best_x(self) -> Array:
        """(n,) where it is."""
        x = np.array(self.known.best_x)
        return (x - self._origin) / self._width if self.unit_cube else x

    @property
    def evidence(self) -> Evidence:
        """Why the best known objective may be the best there is."""
        return self.known.evidence

    def to_pymoo(self, *, rows: bool = False) -> Any:
        """``pymoo.core.problem.Problem``, vectorised; its G is the total violation, or with ``rows`` every row."""
        check_installed("pymoo")
        from nlp_gait.gaitbench.adapters.pymoo import to_pymoo

        return to_pymoo(self, rows=rows)

    def to_pygmo(self) -> Any:
        """``pygmo.problem`` with every row as an inequality, gradients and batches."""
        check_installed("pygmo")
        from nlp_gait.gaitbench.adapters.pygmo import to_pygmo

        return to_pygmo(self)

    def to_ioh(self) -> Any:
        """Problem of ``ioh`` with the optimum; the total violation is a soft constraint, which adds to the objective."""
        check_installed("ioh")
        from nlp_gait.gaitbench.adapters.ioh import to_ioh

        return to_ioh(self)

    def to_scipy(self) -> dict[str, Any]:
        """Arguments of ``scipy.optimize.minimize``: fun, jac, bounds, constraints."""
        from nlp_gait.gaitbench.adapters.scipy import to_scipy

        return to_scipy(self)

    def to_cma(self) -> dict[str, Any]:
        """Arguments of ``cma.fmin_con2``; its constraints are the worst row of each group of rows."""
        check_installed("cma")
        from nlp_gait.gaitbench.adapters.cma import to_cma

        return to_cma(self)

    def to_optuna(self) -> Any:
        """Benchmark problem of OptunaHub, which is an objective of Optuna; the total violation is its constraint."""
        check_installed("optuna")
        check_installed("optunahub")
        from nlp_gait.gaitbench.adapters.optuna import to_optuna

        return to_optuna(self)

    def to_nevergrad(self) -> Any:
        """Experiment function of nevergrad, with a method ``violation`` for ``constraint_violation``."""
        check_installed("nevergrad")
        from nlp_gait.gaitbench.adapters.nevergrad import to_nevergrad

        return to_nevergrad(self)

    @property
    def _slope(self) -> Array:
        """(n,) dx of physical units by that of the variables."""
        return self._width if self.unit_cube else np.ones(len(self.names))

    @cached_property
    def _objective(self) -> CompiledObjective:
        with _BUILDING:
            return compile_objective(self.gait_problem, threads=1)  # a pool of threads would not outlive a fork

    @cached_property
    def _sides(self) -> Sides:
        with _BUILDING:
            return Sides(kernel_of(self.gait_problem), self.gait_problem)

    @cached_property
    def _derivatives(self) -> ca.Function:
        with _BUILDING:
            return self.gait_problem.built("gaitbench derivatives", lambda: _derivatives(self.gait_problem))

    def _physical(self, X: Array) -> Array:
        return self._origin + np.asarray(X, dtype=float) * self._width if self.unit_cube else X

    def _point(self, x: Array) -> Array:
        array = np.asarray(x, dtype=float)
        if array.shape != (len(self.names),):
            raise InputError(f"x of {self.id} must have {len(self.names)} values, got shape {array.shape}")
        return np.asarray(self._physical(array))


def load(id: str, *, unit_cube: bool = False) -> Instance:
    """An instance of GaitBench.

    Args:
        id: one of ``names()``.
        unit_cube: let every variable run from 0 to 1.

    Raises:
        UnknownNameError: no such instance.
    """
    check_name("instance", id)
    return _loaded(id, bool(unit_cube))


@lru_cache(maxsize=128)
def _loaded(id: str, unit_cube: bool) -> Instance:
    with _BUILDING:
        return Instance(id, unit_cube=unit_cube)


def _again(id: str, unit_cube: bool) -> Instance:
    return load(id, unit_cube=unit_cube)


def _derivatives(problem: GaitProblem) -> ca.Function:
    x, p = ca.MX.sym("x", len(problem.names)), ca.MX.sym("p", len(problem.parameters))
    cost, g = kernel_of(problem).function(x, p)
    own = g[: g.shape[0] - len(problem.names)]
    return ca.Function("derivatives", [x, p], [ca.gradient(cost, x), ca.densify(ca.jacobian(own, x))])
