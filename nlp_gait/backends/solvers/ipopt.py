"""IPOPT on a problem's NLP: one run from one start point, in stages of narrowing sigmoid width."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nlp_gait.backends.interrupts import deferred_interrupts, never
from nlp_gait.backends.nlp import WIDTHS, nlp_model
from nlp_gait.backends.solvers.derivatives import CompiledNlp, derivatives_of, worthwhile
from nlp_gait.backends.solvers.ipopt_installation import LINEAR_SOLVERS, QUIET, linear_solver
from nlp_gait.backends.solvers.iteration_watch import REASONS, IterationWatch
from nlp_gait.backends.solvers.solver import Solver, counted, judged
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.locking import one_at_a_time
from nlp_gait.problem.solution import FEASIBILITY_TOLERANCE, Evaluations, Guess, Outcome

LOG = logging.getLogger("nlp_gait")

STATUS_WORDS = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to IPOPT's acceptable level only",
    "Infeasible_Problem_Detected": "converged to a point of local infeasibility",
    "Maximum_Iterations_Exceeded": "stopped at the iteration limit",
    "Restoration_Failed": "restoration of feasibility failed",
    "Search_Direction_Becomes_Too_Small": "search direction became too small",
    "Diverging_Iterates": "iterates diverged",
    "Invalid_Number_Detected": "a function returned NaN or inf",
    "Error_In_Step_Computation": "the linear solver failed",
    **REASONS,
}
CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
# Sigmoid widths of further stages, which are tried only if the exact functions find the point infeasible.
NARROWER_WIDTHS = (1e-4, 2e-5)
# Barrier parameter at which a warm-started stage begins: near the last one, so that a good guess is not first driven off.
# Over the 50 points of nao-ssp's swing heights 1e-5 takes 574 iterations, 1e-8 takes 138; over its durations 584 and 332.
WARM_BARRIER = 1e-8


@dataclass(frozen=True, kw_only=True)
class IpoptSettings(Solver):
    """IPOPT with its settings.

    Attributes:
        tolerance: IPOPT's ``tol``.
        iterations: limit of iterations for each stage.
        time_limit_s: limit of wall time for all stages of a run [s]; checked after each iteration.
        hessian: ``"exact"`` or ``"limited-memory"``; None for the one that suits the problem.
        compiled: compile the NLP's functions and derivatives; None does where the number of solves pays for it and there
            is a compiler.
        linear_solver: one of ``LINEAR_SOLVERS``; None for IPOPT's default. One that does not run here is refused: IPOPT
            never takes another one in its place.
    """

    name: ClassVar[str] = "ipopt"

    tolerance: float = 1e-8
    iterations: int = 300
    time_limit_s: float = 300.0
    hessian: str | None = None
    compiled: bool | None = None
    linear_solver: str | None = None

    def __post_init__(self) -> None:
        """Refuse what IPOPT would refuse late."""
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance must be within (0, 1), got {self.tolerance}")
        if self.iterations < 1 or not self.time_limit_s > 0.0:
            raise InputError(
                f"iterations and time_limit_s must be positive, got {self.iterations}, {self.time_limit_s}"
            )
        if self.hessian not in (None, "exact", "limited-memory"):
            raise InputError(f"hessian must be 'exact', 'limited-memory' or None, got {self.hessian!r}")
        if self.linear_solver not in (None, *LINEAR_SOLVERS):
            raise InputError(f"linear_solver must be one of {', '.join(LINEAR_SOLVERS)}, got {self.linear_solver!r}")

    def settled(self, problem: GaitProblem, solves: int = 1) -> IpoptSettings:
        """See ``Solver``; compiled functions are the same ones, and stay open."""
        return replace(self, hessian=self.hessian or problem.hessian)

    def ready_for(self, problem: GaitProblem, solves: int = 1) -> Ipopt:
        """IPOPT for a problem, made once for all its copies.

        Args:
            problem: any copy.
            solves: how many are planned, which decides whether compiling pays if the settings leave it open.

        Raises:
            CompilerError: compiled functions are demanded, and there is no compiler or it fails.
        """
        chosen = replace(self.settled(problem, solves), compiled=bool(self.compiled))
        try:
            if self.compiled is None:
                chosen = replace(chosen, compiled=worthwhile(problem, solves, second=chosen.hessian == "exact"))
            return problem.built(f"ipopt {chosen}", lambda: Ipopt(problem, chosen))
        except CompilerError as error:
            if self.compiled:
                raise
            LOG.warning("IPOPT's functions are interpreted: %s", error)
            return replace(self, compiled=False).ready_for(problem)

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """See ``Solver``."""
        return self.ready_for(problem).run(problem, x0, stop)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """See ``Solver``."""
        return self.ready_for(problem).run_from(problem, near, stop)


class Ipopt(Solver):
    """IPOPT made for one problem's mathematics, cold and warm, shared by all copies that differ in parameter values only.

    Attributes:
        model: the NLP.
        linear_solver: the one that IPOPT really uses.
        compiled: whether it calls compiled functions.
        create_s: time to generate derivatives and solvers, and to compile them [s].
    """

    name: ClassVar[str] = IpoptSettings.name

    def __init__(self, problem: GaitProblem, settings: IpoptSettings) -> None:
        self.model = model = nlp_model(problem)
        started = time.perf_counter()
        self.linear_solver = linear_solver(settings.linear_solver)
        self._time_limit_s = settings.time_limit_s
        self._watch = IterationWatch(model.nlp)
        options: dict[str, Any] = {
            **QUIET,
            "iteration_callback": self._watch,
            "ipopt.mu_strategy": "adaptive",
            "ipopt.tol": settings.tolerance,
            "ipopt.bound_relax_factor": 0.0,  # else optima violate the exact limits by what IPOPT relaxes them
            "ipopt.max_iter": settings.iterations,
            "ipopt.max_wall_time": settings.time_limit_s,
            "ipopt.hessian_approximation": settings.hessian,
            **({} if settings.linear_solver is None else {"ipopt.linear_solver": settings.linear_solver}),
        }
        self.compiled = bool(settings.compiled)
        nlp = model.nlp
        if self.compiled:
            at = np.append(problem.p, model.widths[0])
            native = CompiledNlp(model.nlp, at, second=settings.hessian == "exact")
            nlp, options = native.nlp, options | native.options
        self._cold = ca.nlpsol("cold", "ipopt", nlp, options)
        warm_options: dict[str, Any] = {
            **options,
            **derivatives_of(self._cold),
            "ipopt.mu_strategy": "monotone",
            "ipopt.mu_init": WARM_BARRIER,
            "ipopt.warm_start_init_point": "yes",
            "ipopt.warm_start_bound_push": 1e-6,
            "ipopt.warm_start_slack_bound_push": 1e-6,
            "ipopt.warm_start_mult_bound_push": 1e-6,
        }
        self._warm = ca.nlpsol("warm", "ipopt", nlp, warm_options)
        self.create_s = time.perf_counter() - started

    @one_at_a_time
    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """All stages from a start point (n,), unless ``stop`` says to end; it is asked after each iteration."""
        start = {"x0": self.model.start(problem, x0, self.model.widths[0])}
        return self._stages(problem, x0, start, self.model.widths, stop, cold=True)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """The last stage alone, from the outcome of a neighbouring problem; None if that has no multipliers."""
        guess = near.guess
        if guess is None:
            return None
        x0 = np.clip(near.x, problem.lower, problem.upper)
        start = {"x0": guess.primal, "lam_x0": guess.bounds, "lam_g0": guess.rows}
        return self._stages(problem, x0, start, WIDTHS[-1:], stop, cold=False)

    @one_at_a_time
    def _stages(
        self,
        problem: GaitProblem,
        x0: Array,
        start: dict[str, Array],
        widths: tuple[float, ...],
        stop: Callable[[], bool],
        cold: bool,
    ) -> Outcome:
        """Stages of a run. Where the caller does not ask to stop, Ctrl-C ends the iterations and is raised after them."""
        model, p = self.model, problem.p
        bounds = model.bounds(problem)
        iterations, evaluations = 0, Evaluations()
        started = time.perf_counter()
        with deferred_interrupts() if stop is never else nullcontext(stop) as asked:
            self._watch.begin(asked, started + self._time_limit_s)
            for stage, width in enumerate((*widths, *(NARROWER_WIDTHS if model.smoothed else ()))):
                solver = self._cold if cold and stage == 0 else self._warm
                result = solver(p=np.append(p, width), **start, **bounds)
                stats = solver.stats()
                iterations += int(stats["iter_count"])
                evaluations += counted(stats)
                z, rows, multipliers = (np.array(result[key]).ravel() for key in ("x", "lam_g", "lam_x"))
                start = {"x0": z, "lam_x0": multipliers, "lam_g0": rows}
                status = self._watch.reason or str(stats["return_status"])
                if stage + 1 < len(widths) and status not in REASONS:
                    continue
                outcome = judged(
                    self.name,
                    problem,
                    x0,
                    model.point(z),
                    claimed=status in CONVERGED,
                    status=STATUS_WORDS.get(status, status.replace("_", " ").lower()),
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
        if stop is never and asked():
            raise KeyboardInterrupt
        if outcome.claimed and not outcome.feasible:
            refused = f"{outcome.status}, but the exact functions find it infeasible"
            return replace(outcome, claimed=False, status=refused)
        return outcome
