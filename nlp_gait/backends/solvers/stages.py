"""Runs of a method on a problem's NLP in stages of narrowing sigmoid width, each of which starts from the last one."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from nlp_gait.backends.nlp import WIDTHS, NlpModel
from nlp_gait.backends.solvers.iteration_watch import REASONS, IterationWatch
from nlp_gait.backends.solvers.solver import Solver, count_evaluations, judge_point
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Evaluations, Guess, Outcome
from nlp_gait.interrupts import defer_interrupts, never

CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
# Sigmoid widths of further stages, used only if the exact functions find the point infeasible.
NARROWER_WIDTHS = (1e-4, 2e-5)


class Method(Protocol):
    """A method that minimises an NLP: an ``nlpsol`` of CasADi, or an object with the same interface."""

    def __call__(self, **arguments: Any) -> Mapping[str, Any]:
        """Return x, lam_x, lam_g from x0, p, bounds lbx, ubx, lbg, ubg and, to start warm, multipliers lam_x0, lam_g0."""

    def stats(self) -> Mapping[str, Any]:
        """Return return_status, iter_count, and n_call_... of each function of the last call."""


class StagedSolver(Solver):
    """A method made for one problem's mathematics, cold and warm, shared by all copies that differ in parameter values only.

    Attributes:
        model: the NLP.
        cold: method of the first stage.
        warm: method of the other stages, and for neighbouring problems.
        watch: called after each iteration of both.
        words: messages for their statuses.
        time_limit_s: limit of wall time for all stages of a run [s].
        linear_solver: the linear solver in use.
        compiled: whether compiled functions are called.
        create_s: time to generate derivatives and methods, and to compile them [s].
    """

    model: NlpModel
    cold: Method
    warm: Method
    watch: IterationWatch
    words: Mapping[str, str]
    time_limit_s: float
    linear_solver: str
    compiled: bool
    create_s: float

    @lock_casadi
    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """Run all stages from a start point (n,); ``stop`` is called after each iteration."""
        start = {"x0": self.model.start(problem, x0, self.model.widths[0])}
        return self._run_stages(problem, x0, start, self.model.widths, stop, cold=True)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """Run the last stage alone from the outcome of a neighbouring problem; None if that has no multipliers."""
        guess = near.guess
        if guess is None:
            return None
        x0 = np.clip(near.x, problem.lower, problem.upper)
        start = {"x0": guess.primal, "lam_x0": guess.bounds, "lam_g0": guess.rows}
        return self._run_stages(problem, x0, start, WIDTHS[-1:], stop, cold=False)

    @lock_casadi
    def _run_stages(
        self,
        problem: GaitProblem,
        x0: Array,
        start: dict[str, Array],
        widths: tuple[float, ...],
        stop: Callable[[], bool],
        cold: bool,
    ) -> Outcome:
        """Run the stages. If the caller gives no ``stop``, Ctrl-C ends the iterations and is raised after them."""
        model, p = self.model, problem.p
        bounds = model.bounds(problem)
        iterations, evaluations = 0, Evaluations()
        started = time.perf_counter()
        with defer_interrupts() if stop is never else nullcontext(stop) as pressed:
            self.watch.begin(pressed, started + self.time_limit_s)
            for stage, width in enumerate((*widths, *(NARROWER_WIDTHS if model.smoothed else ()))):
                method = self.cold if cold and stage == 0 else self.warm
                result = method(p=np.append(p, width), **start, **bounds)
                stats = method.stats()
                iterations += int(stats["iter_count"])
                evaluations += count_evaluations(stats)
                z, rows, multipliers = (np.array(result[key]).ravel() for key in ("x", "lam_g", "lam_x"))
                start = {"x0": z, "lam_x0": multipliers, "lam_g0": rows}
                status = self.watch.reason or str(stats["return_status"])
                if stage + 1 < len(widths) and status not in REASONS:
                    continue
                outcome = judge_point(
                    self.name,
                    problem,
                    x0,
                    model.point(z),
                    claimed=status in CONVERGED,
                    status=self.words.get(status, status.replace("_", " ").lower()),
                    iterations=iterations,
                    evaluations=evaluations,
                    build_s=model.build_s,
                    compile_s=self.create_s,
                    time_s=time.perf_counter() - started,
                    functions="compiled" if self.compiled else "interpreted",
                    linear_solver=self.linear_solver,
                    guess=Guess(primal=z, bounds=multipliers, rows=rows, width=width),
                )
                if not outcome.claimed or outcome.violation <= FEASIBILITY_TOLERANCE:
                    break
        if stop is never and pressed():
            raise KeyboardInterrupt
        if outcome.claimed and not outcome.feasible:
            refused = f"{outcome.status}, but the exact functions find it infeasible"
            return replace(outcome, claimed=False, status=refused)
        return outcome
