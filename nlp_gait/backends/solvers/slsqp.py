"""SLSQP with finite differences on the compiled objective: a baseline without symbolic derivatives."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Best, Evaluations, Outcome
from nlp_gait.interrupts import never

# Forward differences in the scaled variables: the square root of the machine's precision.
STEP = 1.5e-8
TOLERANCE = 1e-10


class _Ended(Exception):
    """The budget or the time is used up, or the caller stops the run."""


@dataclass(frozen=True, kw_only=True)
class Slsqp(Solver):
    """SciPy's SLSQP with forward differences; its outcome is the best point that it evaluated.

    Source:
        Kraft (1988), A software package for sequential quadratic programming, as in ``scipy.optimize.minimize``.
    """

    name: ClassVar[str] = "slsqp"

    evaluations: int = 10_000  #: budget, each finite difference included
    time_limit_s: float | None = None  #: limit of wall time [s]; None for no limit

    def check(self, problem: GaitProblem) -> None:
        if self.evaluations <= len(problem.names):
            raise InputError(f"slsqp needs at least {len(problem.names) + 1} evaluations for one gradient")

    def to_dict(self) -> dict[str, Any]:
        return {"kind": "SLSQP", "step": STEP, "ftol": TOLERANCE, "evaluations": self.evaluations}

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        from scipy.optimize import minimize
        from threadpoolctl import threadpool_limits

        started = time.perf_counter()
        functions = _Functions(problem, self, stop)
        rows: dict[str, Any] = {"type": "ineq", "fun": lambda z: functions.evaluate(z.tobytes())[1][0]}
        rows["jac"] = lambda z: functions.differentiate(z.tobytes())[1]
        try:
            with threadpool_limits(limits=1, user_api="blas"):  # their number changes LAPACK's rounding
                result = minimize(
                    lambda z: functions.evaluate(z.tobytes())[0][0],
                    (x0 - functions.offset) / functions.scale,
                    jac=lambda z: functions.differentiate(z.tobytes())[0],
                    method="SLSQP",
                    bounds=list(zip(functions.lower, functions.upper, strict=True)),
                    constraints=[rows],
                    options={"maxiter": self.evaluations, "ftol": TOLERANCE},
                )
            status, converged, iterations = str(result.message), bool(result.success), int(result.get("nit", 0))
        except _Ended as ended:
            status, converged, iterations = str(ended), False, functions.gradients
        time_s = time.perf_counter() - functions.started
        violation, cost, x = functions.best
        return Outcome(
            solver=self.name,
            x0=x0,
            x=x,
            claimed=converged and violation <= FEASIBILITY_TOLERANCE,
            status=status,
            objective=problem.objective.sign * cost,
            cost=cost,
            violation=violation,
            iterations=iterations,
            evaluations=Evaluations(f=functions.calls),
            compile_s=functions.started - started,
            time_s=time_s,
            functions=functions.backend,
            history=tuple(functions.history),
            objective_s=functions.objective_s,
        )


class _Functions:
    """Objective, rows and their forward differences in scaled variables z, counted; a row is g >= 0 in units of its scale."""

    def __init__(self, problem: GaitProblem, limits: Slsqp, stop: Callable[[], bool]) -> None:
        self._problem = problem
        self._limits = limits
        self._stop = stop
        self._objective = compile_objective(problem)
        self.backend = self._objective.backend
        model = build_exact_model(problem)
        values = model.at(problem.lower, problem.p)
        rows = slice(0, len(model.row_names) - len(problem.names))  # SLSQP takes the bounds of the variables separately
        self._row_lower, self._row_upper = values.lower[rows], values.upper[rows]
        self._row_scale = model.row_scales[rows]
        self.offset = np.array([variable.lower for variable in problem.variables])
        self.scale = problem.scale
        self.lower = (problem.lower - self.offset) / self.scale
        self.upper = (problem.upper - self.offset) / self.scale
        self.calls = 0
        self.gradients = 0
        self.objective_s = 0.0
        self.best: tuple[float, float, Array] = (math.inf, math.inf, problem.lower)
        self.history: list[Best] = []
        # SLSQP evaluates the cost and the rows of a point one after the other; here they are evaluated together.
        self.evaluate = lru_cache(maxsize=1)(lambda key: self._evaluate(np.atleast_2d(np.frombuffer(key))))
        self.differentiate = lru_cache(maxsize=1)(self._differentiate)
        self.started = time.perf_counter()

    def _differentiate(self, key: bytes) -> tuple[Array, Array]:
        """Return gradient (n,) of the cost and Jacobian (m, n) of the rows at z (n,)."""
        z = np.frombuffer(key)
        f, rows = self.evaluate(key)
        step = np.where(z + STEP <= self.upper, STEP, -STEP)
        step[self.upper - self.lower < STEP] = STEP  # a fixed variable; its slope is not used
        shifted_f, shifted_rows = self._evaluate(z + np.diag(step))
        self.gradients += 1
        return (shifted_f - f) / step, ((shifted_rows - rows) / step[:, None]).T

    def _evaluate(self, Z: Array) -> tuple[Array, Array]:
        """Return costs (P,) and rows (P, m) of points Z (P, n), and remember the best point."""
        limits = self._limits
        if self.calls + len(Z) > limits.evaluations:
            raise _Ended("evaluation budget used")
        if limits.time_limit_s is not None and time.perf_counter() - self.started > limits.time_limit_s:
            raise _Ended("time limit reached")
        if self._stop():
            raise _Ended("was interrupted")
        X = self.offset + self.scale * Z
        before = time.perf_counter()
        f, violation = self._objective(X)
        g = self._objective.constraints(X)[:, : len(self._row_scale)]
        self.objective_s += time.perf_counter() - before
        self.calls += len(Z)
        violations = np.where(violation <= FEASIBILITY_TOLERANCE, 0.0, violation)
        leader = int(np.lexsort((f, violations))[0])
        point = (float(violations[leader]), float(f[leader]), X[leader].copy())
        self.best = min(self.best, point, key=lambda best: best[:2])
        objective = self._problem.objective.sign * self.best[1] if self.best[0] == 0.0 else None
        self.history.append(Best(self.calls, objective, time.perf_counter() - self.started))
        sides = [(g - self._row_lower) / self._row_scale, (self._row_upper - g) / self._row_scale]
        finite = [np.isfinite(self._row_lower), np.isfinite(self._row_upper)]
        return f, np.hstack([side[:, bounded] for side, bounded in zip(sides, finite, strict=True)])
