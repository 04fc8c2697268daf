"""Solve a problem again after its parameters changed, within milliseconds, by sequential quadratic programming."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import ThreadpoolController

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.onboard.nlp_functions import NlpFunctions
from nlp_gait.backends.onboard.reduced_qp import LEAST_COST, LEAST_DAMPING, Step, StepSolver
from nlp_gait.backends.optima.optimum import find_optimum
from nlp_gait.backends.optima.sensitivities import differentiate_by_parameters
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, ConstraintValue, Guess, Outcome, Solution

# The last step misses the predicted cost by less than this share, violates less than this total, is shorter than this share.
COST_ERROR, VIOLATION, SHORT = 1e-7, 1e-8, 1e-3
CORRECTED = 3e-4  # longest step that is corrected: a longer one needs new derivatives
SOLVES = 1000  # planned, for IPOPT's decision whether compilation pays
# Longest step, as a share of the variables' ranges: shorter after a step that had to be shortened, or whose program failed.
LONGEST, SHORTEN, SHORTEST = 0.25, 2.5, 1e-3
# Factors of the damping after a program failed, and after a shortened or a full step.
DAMP_FAILED, DAMP_SHORTENED, DAMP_LESS = 10.0, 4.0, 0.8
SHARES = (1.0, 0.5, 0.25, 0.1, 0.03)  # of a step that are tried
PRICE_FACTOR = 2.0  # weight of the violation in the merit, in units of the largest multiplier
MEMORY = 3  # a step may raise the merit above that of the last point, not above all of so many
ROUNDING = 1e-9  # relative difference of merits, and length of a step, that rounding may cause


@dataclass(frozen=True, kw_only=True, eq=False)
class Replan:
    """Result of ``Replanner.solve``."""

    x: Array  #: (n,) decision variables: the optimum, else the best feasible point, else the last one
    objective: float  #: at x, in the problem's sense
    feasible: bool  #: whether x satisfies all constraints, judged by the exact functions if that was requested
    converged: bool  #: whether x is a local optimum
    iterations: int  #: steps, and IPOPT's iterations
    time_s: float = 0.0  #: wall time [s]
    solver: str = "sqp"  #: that found x: ``"sqp"`` or ``"ipopt"``
    note: str  #: why it did not converge, or why IPOPT was used; else empty
    violated: tuple[ConstraintValue, ...] = ()  #: violated constraints and by how much, worst first
    guess: Guess  #: x and its multipliers in the lifted NLP


def make_replanner(
    problem: GaitProblem | str,
    *,
    near: Solution | None = None,
    starts: int | None = None,
    seed: int = 0,
    predict: bool = False,
) -> "Replanner":
    """Return a solver for one problem with changing parameters; it is built once, and continues from its last optimum.

    Args:
        problem: with the parameter values to begin with; a name is loaded with its defaults.
        near: solution by IPOPT to begin from; None to solve the problem.
        starts: number of start points for that; None for the problem's default.
        seed: of the start points.
        predict: whether to start from the first optimum moved by its derivatives by the parameters, instead of the last result;
            saves steps only where the same bounds stay active.

    Raises InputError without DAQP, an optimum with multipliers, or, with ``predict``, its derivatives.
    """
    problem = load(problem) if isinstance(problem, str) else problem
    if near is None:
        count = problem.hints.starts if starts is None else starts
        near = solve(problem, starts=count, seed=seed)
    return Replanner(problem, min(near.starts, key=lambda outcome: outcome.rank), predict=predict)


class Replanner:
    """Steps of sequential quadratic programming from the last optimum and its multipliers; made by ``make_replanner``."""

    def __init__(self, problem: GaitProblem, near: Outcome, *, predict: bool = False) -> None:
        """Use ``make_replanner`` instead."""
        if near.guess is None or not near.converged:
            name = problem.name
            raise InputError(f"{name}: planning again needs an optimum by IPOPT to begin from; it {near.status}")
        self.problem = problem
        self._ipopt = IpoptSettings(hessian="exact").prepare(problem, solves=SOLVES)
        self._functions = NlpFunctions(problem, self._ipopt.functions)
        self._steps = StepSolver(self._functions)
        self._exact = build_exact_model(problem)
        self._scale = self._exact.row_scales[: len(self._functions.model.row_names)]
        self._threads = ThreadpoolController()
        self._near, self._first = near, near
        self._slopes = differentiate_by_parameters(find_optimum(problem, near)) if predict else None
        self.restart()

    def restart(self) -> None:
        """Continue from the first optimum, so that the same calls give the same numbers."""
        assert self._first.guess is not None  # checked when it was made
        self._near, self._guess = self._first, self._first.guess
        self._steps.begin(self._guess.rows)
        self._steps.damping = LEAST_DAMPING

    @lock_casadi
    def solve(
        self,
        p: Mapping[str, float] | Sequence[float] | Array | None = None,
        x0: Sequence[float] | Array | Mapping[str, float] | None = None,
        *,
        iterations: int = 20,
        time_limit_s: float = math.inf,
        judge: bool = False,
    ) -> Replan:
        """Return the optimum for other parameter values.

        If a limit is reached, the best feasible point so far is returned, or the last point with the violated constraints. If the
        steps fail within the limits, IPOPT solves the problem, and ``note`` says so.

        Args:
            p: values by name, others as in the replanner's problem; or all of them (k,), in the order of ``problem.parameters``.
            x0: start point; None for the last result, or the predicted point.
            iterations: limit of steps; IPOPT is not limited by it.
            time_limit_s: limit of wall time, checked after each step; with a limit IPOPT is not used.
            judge: whether the exact functions judge x, which takes about a millisecond.

        Raises UnknownNameError or InputError for a parameter or x0 that is not allowed.
        """
        started = time.perf_counter()
        problem = self._change(p)
        guess = self._guess
        if x0 is None and self._slopes is not None:
            slopes = np.where(self._slopes.defined, self._slopes.x, 0.0)
            x0 = np.clip(self._first.x + slopes @ (problem.p - self.problem.p), problem.lower, problem.upper)
        if x0 is not None:
            primal = self._functions.model.start(problem, problem.check_x(x0), guess.width)
            guess = replace(guess, primal=primal)
        with self._threads.limit(limits=1):
            run = _Run(problem, self._functions, self._steps, self._scale, guess)
            run.improve(iterations, started + time_limit_s)
        found = run.result()
        if not found.feasible:
            found = replace(found, violated=self._exact.find_violated(self._exact.at(found.x, problem.p)))
        if run.converged or found.feasible:
            self._guess = found.guess
        if not run.converged:
            self._steps.begin(self._guess.rows)
        if not run.converged and math.isinf(time_limit_s):
            found = self._solve_by_ipopt(problem, found)
        if judge:
            values = self._exact.at(found.x, problem.p)
            objective = problem.objective.sign * values.cost
            violated = self._exact.find_violated(values)
            found = replace(found, objective=objective, feasible=values.feasible, violated=violated)
        return replace(found, time_s=time.perf_counter() - started)

    def _change(self, p: Mapping[str, float] | Sequence[float] | Array | None) -> GaitProblem:
        if p is None:
            return self.problem
        if not isinstance(p, Mapping):
            names = [parameter.name for parameter in self.problem.parameters]
            if len(p) != len(names):
                raise InputError(f"p must be values by name, or all {len(names)} in order, got {len(p)}")
            p = dict(zip(names, np.asarray(p, dtype=float).tolist(), strict=True))
        return self.problem.with_values(**p)

    def _solve_by_ipopt(self, problem: GaitProblem, found: Replan) -> Replan:
        near = replace(self._near, guess=self._guess, x=found.x)
        outcome = self._ipopt.run_from(problem, near)
        if outcome is None or not outcome.converged:
            cold = self._ipopt.run(problem, np.clip(found.x, problem.lower, problem.upper))
            outcome = cold if outcome is None else min(outcome, cold, key=lambda each: each.rank)
        note = f"{found.note}; IPOPT {outcome.status}"
        iterations = found.iterations + outcome.iterations
        found = replace(found, note=note, iterations=iterations)
        if outcome.converged and outcome.guess is not None:
            self._guess, self._near = outcome.guess, outcome
            self._steps.begin(outcome.guess.rows)
        elif found.feasible:
            return found
        violated = self._exact.find_violated(self._exact.at(outcome.x, problem.p))
        return replace(
            found,
            x=outcome.x,
            objective=outcome.objective,
            feasible=outcome.feasible,
            converged=outcome.converged,
            solver="ipopt",
            violated=violated,
            guess=outcome.guess or found.guess,
        )


class _Run:
    """Steps from a guess to the optimum of a problem."""

    def __init__(self, problem: GaitProblem, at: NlpFunctions, steps: StepSolver, scale: Array, guess: Guess) -> None:
        self._problem, self._at, self._steps, self._scale = problem, at, steps, scale
        model = at.model
        at.set_parameters(problem.p)
        self._z_lower = (problem.lower - model.offset) / model.scale
        self._z_upper = (problem.upper - model.offset) / model.scale
        self._n, self._width, self._multipliers = model.variables, guess.width, guess.rows
        self.iterations, self.converged, self.note = 0, False, ""
        self._go_to(guess.primal.copy())
        self._best: tuple[float, Array] | None = None
        self._keep_best()

    def improve(self, iterations: int, deadline: float) -> None:
        """Take steps until one converges or a limit is reached."""
        merits: list[float] = []
        longest = LONGEST
        while not self.converged:
            if self.iterations >= iterations or time.perf_counter() >= deadline:
                self.note = f"stopped at the limit after {self.iterations} steps"
                return
            at, n = self._at, self._n
            w, cost = self._w, float(at.cost[0])
            size = max(abs(cost), LEAST_COST)
            at.differentiate(self._multipliers)
            z_lower, z_upper = np.maximum(self._z_lower - w[:n], -longest), np.minimum(self._z_upper - w[:n], longest)
            g = at.g.copy()
            self._steps.prepare(self._ties)
            step = self._steps.solve(at.lower - g, at.upper - g, z_lower, z_upper)
            self.iterations += 1
            if step is None and (self._steps.damping < 1.0 or longest > SHORTEST):
                longest /= SHORTEN if self._steps.damping == 1.0 else 1.0
                self._steps.damping = min(DAMP_FAILED * self._steps.damping, 1.0)
                continue
            if step is None:
                self.note = f"the quadratic program of step {self.iterations} failed"
                return
            weight = PRICE_FACTOR * np.abs(step.multipliers[: len(self._scale)] * self._scale).max(initial=0.0)
            merits = [*merits[1 - MEMORY :], cost + weight * self._violation]
            for share in SHARES:
                self._go_to(w + share * step.w)
                if at.cost[0] + weight * self._violation <= max(merits) + ROUNDING * size:
                    break
            error, length = self._miss(step, cost), float(np.abs(step.w[:n]).max(initial=0.0))
            is_short = share == 1.0 and length <= SHORT and length < longest
            if is_short and length <= CORRECTED and (error > COST_ERROR * size or self._violation > VIOLATION):
                step = self._correct(step, w, g, z_lower, z_upper, weight)
                error = self._miss(step, cost)
            self._multipliers = self._multipliers + share * (step.multipliers - self._multipliers)
            self._keep_best()
            factor = DAMP_LESS if share == 1.0 else DAMP_SHORTENED
            self._steps.damping = min(max(factor * self._steps.damping, LEAST_DAMPING), 1.0)
            self.converged = (
                is_short
                and error <= COST_ERROR * size
                and self._violation <= VIOLATION
                and not step.relaxed
                and step.estimate_rest() <= COST_ERROR * size
            )
            longest = min(2.0 * longest, LONGEST) if share == 1.0 else max(share * length, ROUNDING)

    def _miss(self, step: Step, cost: float) -> float:
        return abs(float(self._at.cost[0]) - cost + step.decrease)

    def _correct(self, step: Step, w: Array, g: Array, z_lower: Array, z_upper: Array, weight: float) -> Step:
        """Return a full step from w, where the rows were g, or one for the rows' values at its end if that reduces the merit."""
        at, end, n = self._at, self._w, self._n
        error = at.g - g - at.rows_by_z @ (end - w)[:n] - at.rows_by_s @ (end - w)[n:]
        merit = at.cost[0] + weight * self._violation
        other = self._steps.solve(at.lower - g - error, at.upper - g - error, z_lower, z_upper)
        if other is None:
            return step
        self._go_to(w + other.w)
        if not at.cost[0] + weight * self._violation < merit:
            self._go_to(end)
            return step
        return replace(other, decrease=other.decrease + float(self._multipliers @ error))

    def result(self) -> Replan:
        """Return the optimum, else the best feasible point, else the last one with its violated rows."""
        at = self._at
        if not self.converged and self._best is not None:
            self._go_to(self._best[1])
        feasible = self._violation <= FEASIBILITY_TOLERANCE and math.isfinite(at.cost[0])
        w, rows = self._w, self._multipliers.copy()
        return Replan(
            x=np.clip(at.model.point(w), self._problem.lower, self._problem.upper),
            objective=self._problem.objective.sign * float(at.cost[0]),
            feasible=feasible,
            converged=self.converged,
            iterations=self.iterations,
            note=self.note,
            guess=Guess(primal=w, bounds=np.zeros(len(w)), rows=rows, width=self._width),
        )

    def _go_to(self, w: Array) -> None:
        """Evaluate the functions at z within its bounds and the exact values of the lifted variables."""
        at, n, first = self._at, self._n, len(self._scale)
        w[:n] = np.clip(w[:n], self._z_lower, self._z_upper)
        at.evaluate(w)
        for _ in range(3):  # a lift may contain others
            self._ties = self._steps.choose_ties(at.g)
            change = at.model.lift_sense * at.g[self._ties]
            if not np.abs(change).max(initial=0.0) > 1e-13:
                break
            w[n:] -= change
            at.evaluate(w)
        rows = at.g[:first]
        self._w = w
        violations = np.maximum(np.maximum(at.lower[:first] - rows, rows - at.upper[:first]), 0.0)
        violation = float(np.sum(violations / self._scale))
        self._violation = violation if math.isfinite(violation) else math.inf

    def _keep_best(self) -> None:
        cost = float(self._at.cost[0])
        if self._violation <= FEASIBILITY_TOLERANCE and (self._best is None or cost < self._best[0]):
            self._best = cost, self._w.copy()
