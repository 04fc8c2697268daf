"""SLSQP with finite differences on the compiled objective: what somebody without symbolic derivatives does."""

from __future__ import annotations

import math
import time

import numpy as np

import nlp_gait
from compare.study.record import History, RunRecord, Times
from compare.study.runs.gradient_run import Outcome, record_of
from compare.study.task import Task
from nlp_gait.backends.exact import FEASIBILITY_TOLERANCE, exact_model
from nlp_gait.problem import Array, GaitProblem

# Forward differences in the scaled variables: the square root of the machine's precision.
STEP = 1.5e-8
TOLERANCE = 1e-10


class _Ended(Exception):
    """The budget or the time is used up."""


def slsqp_run(task: Task) -> RunRecord:
    """Do the run from the problem's random start point and judge its best point.

    Source:
        Kraft (1988), A software package for sequential quadratic programming, as in ``scipy.optimize.minimize``.
    """
    from scipy.optimize import minimize

    started = time.perf_counter()
    problem = task.problem.load()
    built = time.perf_counter()
    functions = _Functions(problem, task)
    compiled = time.perf_counter()
    functions.begin()
    z0 = (problem.start_point(np.random.default_rng(task.run_seed)) - functions.offset) / functions.scale
    try:
        result = minimize(
            functions.cost,
            z0,
            jac=functions.gradient,
            method="SLSQP",
            bounds=list(zip(functions.lower, functions.upper, strict=True)),
            constraints=[{"type": "ineq", "fun": functions.rows, "jac": functions.jacobian}],
            options={"maxiter": task.stop.evaluations, "ftol": TOLERANCE},
        )
        status, converged, iterations = str(result.message), bool(result.success), int(result.nit)
    except _Ended as ended:
        status, converged, iterations = str(ended), False, functions.gradients
    solve = time.perf_counter() - functions.started
    violation, _, x = functions.best
    outcome = Outcome(
        x=x,
        success=converged and violation <= FEASIBILITY_TOLERANCE,
        status=status,
        violation=violation,
        evaluations={"f": functions.calls},
        iterations=iterations,
        settings={"kind": "SLSQP", "step": STEP, "ftol": TOLERANCE, "evaluations": task.stop.evaluations},
        active_constraints=(),
        history=History(
            evaluations=tuple(calls for calls, _, _ in functions.history),
            objective=tuple(objective for _, objective, _ in functions.history),
        ),
        time_s=Times(
            build=built - started,
            compile=compiled - built,
            solve=solve,
            objective=functions.objective_s,
            history=tuple(t for _, _, t in functions.history),
        ),
    )
    return record_of(task, problem, outcome)


class _Functions:
    """Objective, rows and their forward differences in scaled variables z, counted; a row is g >= 0 in units of its scale."""

    def __init__(self, problem: GaitProblem, task: Task) -> None:
        self._problem = problem
        self._stop = task.stop
        self._objective = nlp_gait.compile_objective(problem, threads=1)
        model = exact_model(problem)
        bounds = [np.array(b).ravel() for b in model.function(problem.lower, problem.p)[3:5]]
        own = slice(0, len(model.row_names) - len(problem.names))  # bounds are SLSQP's own
        self._row_lower, self._row_upper = (bound[own] for bound in bounds)
        self._row_scale = model.row_scales[own]
        self.offset = np.array([variable.lower for variable in problem.variables])
        self.scale = problem.scale
        self.lower = (problem.lower - self.offset) / self.scale
        self.upper = (problem.upper - self.offset) / self.scale
        self.calls = 0
        self.gradients = 0
        self.objective_s = 0.0
        self.best: tuple[float, float, Array] = (math.inf, math.inf, problem.lower)
        self.history: list[tuple[int, float | None, float]] = []
        self._known: dict[bytes, tuple[Array, Array]] = {}
        self._slopes: dict[bytes, tuple[Array, Array]] = {}

    def begin(self) -> None:
        """Start the clock."""
        self.started = time.perf_counter()

    def cost(self, z: Array) -> float:
        return float(self._at(z)[0][0])

    def rows(self, z: Array) -> Array:
        return self._at(z)[1][0]

    def gradient(self, z: Array) -> Array:
        return self._slope(z)[0]

    def jacobian(self, z: Array) -> Array:
        return self._slope(z)[1]

    def _at(self, z: Array) -> tuple[Array, Array]:
        key = z.tobytes()
        if key not in self._known:
            self._known = {key: self._evaluate(np.atleast_2d(z))}
        return self._known[key]

    def _slope(self, z: Array) -> tuple[Array, Array]:
        key = z.tobytes()
        if key not in self._slopes:
            f, rows = self._at(z)
            step = np.where(z + STEP <= self.upper, STEP, -STEP)
            step[self.upper - self.lower < STEP] = (
                STEP  # a fixed variable moves nowhere in SLSQP; its slope is not used
            )
            shifted_f, shifted_rows = self._evaluate(z + np.diag(step))
            self.gradients += 1
            self._slopes = {key: ((shifted_f - f) / step, ((shifted_rows - rows) / step[:, None]).T)}
        return self._slopes[key]

    def _evaluate(self, Z: Array) -> tuple[Array, Array]:
        """Costs (P,) and rows (P, m) of points Z (P, n); the best point within the bounds is kept."""
        stop = self._stop
        if self.calls + len(Z) > stop.evaluations:
            raise _Ended("evaluation budget used")
        if stop.time_limit_s is not None and time.perf_counter() - self.started > stop.time_limit_s:
            raise _Ended("time limit reached")
        X = self.offset + self.scale * Z
        before = time.perf_counter()
        f, violation = self._objective(X)
        g = self._objective.constraints(X)[:, : len(self._row_scale)]
        self.objective_s += time.perf_counter() - before
        self.calls += len(Z)
        self._keep_best(X, f, violation)
        sides = [(g - self._row_lower) / self._row_scale, (self._row_upper - g) / self._row_scale]
        finite = [np.isfinite(self._row_lower), np.isfinite(self._row_upper)]
        return f, np.hstack([side[:, known] for side, known in zip(sides, finite, strict=True)])

    def _keep_best(self, X: Array, f: Array, violation: Array) -> None:
        allowed = np.where(violation <= FEASIBILITY_TOLERANCE, 0.0, violation)
        leader = int(np.lexsort((f, allowed))[0])
        found = (float(allowed[leader]), float(f[leader]), X[leader].copy())
        if found[:2] < self.best[:2]:
            self.best = found
        objective = self._problem.objective.sign * self.best[1] if self.best[0] == 0.0 else None
        self.history.append((self.calls, objective, time.perf_counter() - self.started))
