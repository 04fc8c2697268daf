"""IPOPT on a problem's NLP."""

import logging
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from nlp_gait.backends.derivatives.compiled import DERIVATIVES, NLP_VALUES, CompiledNlp
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solvers.solver import (
    LONGEST_INFEASIBLE,
    REASONS,
    IterationWatch,
    Solver,
    WatchedSolver,
    count_evaluations,
    judge_point,
)
from nlp_gait.backends.solvers.working_set import LEAST_ROWS, WorkingSet
from nlp_gait.errors import CompilerError, InputError, check_choice
from nlp_gait.files import make_temporary_folder
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Evaluations, Guess, Outcome
from nlp_gait.interrupts import Stop, defer_interrupts, never

CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
# Sigmoid widths of further stages, for a point that the exact functions find infeasible, or where smoothing is expensive.
NARROWER_WIDTHS = (1e-4, 5e-5, 2e-5)
# Smoothing is expensive if it may cost this share of the objective. Samples keep some widths away from the jump: with 0.065 m
# of mean margin in x, NAO's single support needs 0.55 % too much at 0.5 mm.
EXPENSIVE = 1e-4

# Options of every IPOPT here: it prints nothing, and ignores an ``ipopt.opt`` in the working folder.
QUIET: Mapping[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,  # the status says that a function returned NaN
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.option_file_name": "",
}
# Linear solvers that IPOPT knows; all but the last two load a library that the user must have.
LINEAR_SOLVERS = ("ma27", "ma57", "ma77", "ma86", "ma97", "pardiso", "mumps", "spral")
BARRIERS = ("adaptive", "monotone")  # IPOPT's ``mu_strategy``
STATUS_WORDS = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged to IPOPT's acceptable level only",
    "Infeasible_Problem_Detected": "converged to a point of local infeasibility",
    "Restoration_Failed": "restoration of feasibility failed",
    "Search_Direction_Becomes_Too_Small": "search direction became too small",
    "Diverging_Iterates": "iterates diverged",
    "Invalid_Number_Detected": "a function returned NaN or inf",
    "Error_In_Step_Computation": "the linear solver failed",
    **REASONS,
}
RESTARTED = " from half way to the middle of the bounds"
# MUMPS's approximate minimum fill takes 10 to 30 % less time than its automatic choice, for the same iterations.
PIVOT_ORDER = 2
# Barrier parameter at which a warm-started stage begins: near the last one, so that a good guess is not first driven off.
# Over the 50 points of nao-ssp's swing heights 1e-5 takes 574 iterations, 1e-8 takes 138; over its durations 584 and 332.
WARM_BARRIER = 1e-8
# Solves times the NLP's variables from which compilation pays. NAO's single support, 174 variables: 0.2 s saved on each solve
# against 2.5 s of compilation; its free joints, 3,900 variables: over a minute on each against 8 s.
WORTHWHILE_SIZE = 1500
# Iterations in a row that the first stage may spend on restoring feasibility alone. A start that needs more is abandoned: from
# nao-ssp's, IPOPT took 140 to 300 iterations or ended at an infeasible point; from half way to the middle of the bounds, 25.
LONGEST_RESTORATION = 10


@dataclass(frozen=True, kw_only=True)
class IpoptSettings(Solver):
    """IPOPT with its settings."""

    name: ClassVar[str] = "ipopt"

    tolerance: float = 1e-8  #: IPOPT's ``tol``
    iterations: int = 500  #: limit of iterations of a run, all of its stages together
    #: Limit of wall time for all stages of a run [s]; selecting the rows of a large problem, once for all runs, has as much again
    time_limit_s: float = 300.0
    hessian: str | None = None  #: ``"exact"`` or ``"limited-memory"``; None for the one that suits the problem
    #: how the first stage lowers its barrier: ``"adaptive"``, or ``"monotone"``, which may converge where the other does not
    barrier: str = BARRIERS[0]
    #: whether the NLP's functions and derivatives are compiled; None: where that pays for the number of solves and there is a
    #: compiler
    compiled: bool | None = None
    #: ma27, ma57, ma77, ma86, ma97, pardiso, mumps or spral; None for IPOPT's default. One that does not run here is an error;
    #: it is never replaced by another one
    linear_solver: str | None = None
    #: whether a run begins with the rows that matter instead of all, see docs/computing.md; None: where the functions are
    #: compiled, because selecting the rows takes a run
    few_rows: bool | None = None
    #: few rows are those within this of a bound at the start point, in units of their scales; None: those that one run needs
    within: float | None = None
    #: of the sigmoids that replace a jump, one stage for each, in units of the switch [m for a margin]; empty for those of the
    #: NLP. Narrower ones follow if the exact functions refuse the last stage's point, or if smoothing is expensive there
    widths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance must be within (0, 1), got {self.tolerance}")
        if self.iterations < 1 or not self.time_limit_s > 0.0:
            got = f"{self.iterations}, {self.time_limit_s}"
            raise InputError(f"iterations and time_limit_s must be positive, got {got}")
        if not all(before > after > 0.0 for before, after in pairwise((math.inf, *self.widths))):
            raise InputError(f"widths must be positive and narrow from stage to stage, got {self.widths}")
        check_choice("hessian", self.hessian, (None, "exact", "limited-memory"))
        check_choice("barrier", self.barrier, BARRIERS)
        check_choice("linear_solver", self.linear_solver, (None, *LINEAR_SOLVERS))

    def choose_settings(self, problem: GaitProblem, solves: int = 1) -> "IpoptSettings":
        # Whatever is cached: compiled and interpreted functions differ in the last bits, and the same call gives the same result.
        pays = solves * build_nlp(problem).nlp["x"].shape[0] >= WORTHWHILE_SIZE
        compiled = pays if self.compiled is None else self.compiled
        few_rows = compiled if self.few_rows is None else self.few_rows
        return replace(self, hessian=self.hessian or problem.hints.hessian, compiled=compiled, few_rows=few_rows)

    def prepare(self, problem: GaitProblem, solves: int = 1) -> "Ipopt":
        """Return IPOPT for a problem, built once for all its copies; CompilerError if compiled functions are required and fail.

        ``solves``, the planned number of solves, decides whether compilation pays if the settings do not.
        """
        chosen = self.choose_settings(problem, solves)
        try:
            return problem.build_once(Ipopt, chosen)
        except CompilerError as error:
            if self.compiled:
                raise
            logging.getLogger("nlp_gait").warning("IPOPT's functions are interpreted: %s", error)
            return replace(chosen, compiled=False).prepare(problem)

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        return self.prepare(problem).run(problem, x0, stop)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        return self.prepare(problem).run_from(problem, near, stop)


class Ipopt(Solver):
    """IPOPT for one problem's mathematics, shared by all copies that differ in parameter values only.

    It runs in stages of narrowing sigmoid width: ``cold`` for the first one, ``warm`` for the others and for neighbours.
    """

    name: ClassVar[str] = IpoptSettings.name

    def __init__(self, problem: GaitProblem, settings: IpoptSettings) -> None:
        self.model = model = build_nlp(problem)
        started = time.perf_counter()
        self.linear_solver = find_linear_solver(settings.linear_solver)
        self.time_limit_s, self.iterations = settings.time_limit_s, settings.iterations
        self.widths = settings.widths if settings.widths and model.smoothed else model.widths
        self.watch = IterationWatch(model.nlp)
        general: dict[str, Any] = {
            **QUIET,
            "ipopt.mu_strategy": settings.barrier,
            "ipopt.tol": settings.tolerance,
            "ipopt.bound_relax_factor": 0.0,  # otherwise optima violate the exact limits
            "ipopt.max_iter": settings.iterations,
            "ipopt.max_wall_time": settings.time_limit_s,
            "ipopt.hessian_approximation": settings.hessian,
            **({} if settings.linear_solver is None else {"ipopt.linear_solver": settings.linear_solver}),
            **({"ipopt.mumps_pivot_order": PIVOT_ORDER} if self.linear_solver.lower() == "mumps" else {}),
        }
        options = {**general, "iteration_callback": self.watch}
        brief = {"ipopt.max_resto_iter": LONGEST_RESTORATION}
        self.compiled = bool(settings.compiled)
        nlp = model.nlp
        if self.compiled:
            native = CompiledNlp(nlp, np.append(problem.p, self.widths[0]), second=settings.hessian == "exact")
            nlp, options = native.nlp, options | native.options
        all_rows = ca.nlpsol("cold", "ipopt", nlp, {**options, **brief})
        names = (*NLP_VALUES, *DERIVATIVES.values())
        functions = {name: all_rows.get_function(name) for name in names if all_rows.has_function(name)}
        #: of the NLP, by the names of ``nlpsol``
        self.functions = functions = native.functions if self.compiled else functions
        derivatives = {option: functions[name] for option, name in DERIVATIVES.items() if name in functions}
        warm: dict[str, Any] = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": WARM_BARRIER}
        warm |= {f"ipopt.warm_start_{what}_push": 1e-6 for what in ("bound", "slack_bound", "mult_bound")}
        warm["ipopt.warm_start_init_point"] = "yes"
        self.warm = WatchedSolver(ca.nlpsol("warm", "ipopt", nlp, {**options, **derivatives, **warm}), self.watch)
        # Narrower sigmoids start close to a feasible point: a larger barrier throws samples over the jump, to a worse optimum.
        near: dict[str, Any] = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": WARM_BARRIER}
        near |= {f"ipopt.{what}": 1e-6 for what in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")}
        self.near = self.warm
        if model.smoothed:
            self.near = WatchedSolver(ca.nlpsol("near", "ipopt", nlp, {**options, **derivatives, **near}), self.watch)
        self.cold: WatchedSolver | WorkingSet = WatchedSolver(all_rows, self.watch, LONGEST_INFEASIBLE)
        if settings.few_rows and nlp["g"].shape[0] >= LEAST_ROWS:
            self.cold = self._make_working_set(problem, {**general, **brief}, settings.within)
        self._patient = nlp, {**options, **derivatives}
        self.create_s = time.perf_counter() - started

    @cached_property
    def patient(self) -> WatchedSolver:
        """The first stage on all rows that restores feasibility for as long as it takes."""
        return WatchedSolver(ca.nlpsol("patient", "ipopt", *self._patient), self.watch)

    def _make_working_set(self, problem: GaitProblem, options: Mapping[str, Any], within: float | None) -> WorkingSet:
        """Make a first stage that begins with few rows: ties of lifted variables, equations, and rows near the start.

        Without ``within``, one run at the parameters' defaults finds them, whichever copy of the problem is solved first.
        """
        model = self.model
        usual = problem.with_values(**{parameter.name: parameter.default for parameter in problem.parameters})
        bounds, width = model.bounds(usual), self.widths[0]
        always = bounds["lbg"] == bounds["ubg"]
        always[len(model.row_names) :] = True
        cold = WorkingSet(model.nlp, self.functions, options, self.watch, always, within)
        if within is not None:
            return cold
        start = model.start(usual, usual.start_point(np.random.default_rng(0)), width)
        with defer_interrupts() as pressed:
            self.watch.begin(pressed, time.perf_counter() + self.time_limit_s, self.iterations)
            cold.add_violated_rows(x0=start, p=np.append(usual.p, width), **bounds)
        if pressed():
            raise KeyboardInterrupt
        return cold

    @lock_casadi
    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """Run all stages from a start point (n,), each of which starts from the last one; see ``Solver``.

        Where the first stage stays far from feasible, or takes long to restore feasibility, it starts again from half way to
        the middle of the bounds; and if that fails, too, from the start point without these limits, on all rows.
        """
        half_way = (x0 + (problem.lower + problem.upper) / 2) / 2
        attempts = [
            (method, {"x0": self.model.start(problem, point, self.widths[0])})
            for method, point in ((self.cold, x0), (self.cold, half_way), (None, x0))
        ]
        return self._run_stages(problem, x0, attempts, self.widths, stop)

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """Run the last stage alone from the outcome of a neighbouring problem; None if that has no multipliers."""
        guess = near.guess
        if guess is None:
            return None
        x0 = np.clip(near.x, problem.lower, problem.upper)
        return self._run_stages(problem, x0, [(self.warm, _start_from(guess))], self.widths[-1:], stop)

    @lock_casadi
    def _run_stages(
        self,
        problem: GaitProblem,
        x0: Array,
        attempts: Sequence[tuple["WatchedSolver | WorkingSet | None", dict[str, Array]]],
        widths: tuple[float, ...],
        stop: Stop,
    ) -> Outcome:
        """Run the stages, the first one by the first attempt that converges; None stands for ``patient``.

        If the caller gives no ``stop``, Ctrl-C ends the iterations and is raised after them.
        """
        run = _Run(problem=problem, x0=x0, bounds=self.model.bounds(problem))
        with defer_interrupts() if stop is never else nullcontext(stop) as pressed:
            self.watch.begin(pressed, run.started + self.time_limit_s, self.iterations)
            for number, (method, start) in enumerate(attempts):
                guess = self._run_stage(run, method or self.patient, widths[0], start)
                run.restarts = number
                if run.status in CONVERGED or self.watch.reason:
                    break
            for width in widths[1:]:
                if self.watch.reason:
                    break
                guess = self._run_stage(run, self.warm, width, _start_from(guess))
            outcome = self._run_narrower(run, self._judge(run, guess), guess)
        if stop is never and pressed():
            raise KeyboardInterrupt
        if outcome.claimed and not outcome.feasible:
            refused = f"{outcome.status}, but the exact functions find it infeasible"
            outcome = replace(outcome, claimed=False, status=refused)
        time_s = time.perf_counter() - run.started
        return replace(outcome, time_s=time_s, iterations=run.iterations, evaluations=run.evaluations)

    def _run_narrower(self, run: "_Run", outcome: Outcome, guess: Guess) -> Outcome:
        """Return the outcome of narrower sigmoids: the first feasible one, and from there on the cheapest."""
        for width in NARROWER_WIDTHS if self.model.smoothed else ():
            feasible = outcome.violation <= FEASIBILITY_TOLERANCE
            if not outcome.claimed or (
                feasible and self._estimate_smoothing(run, guess) < EXPENSIVE * abs(outcome.cost)
            ):
                break
            if width >= guess.width:
                continue
            # With its multipliers a feasible point is often thrown over the jump, too.
            method, start = (self.near, {"x0": guess.primal}) if feasible else (self.warm, _start_from(guess))
            next_guess = self._run_stage(run, method, width, start)
            narrower = self._judge(run, next_guess)
            if not feasible or (narrower.converged and narrower.cost < outcome.cost):
                outcome, guess = narrower, next_guess
            if self.watch.reason:
                break
        return outcome

    def _run_stage(
        self, run: "_Run", method: "WatchedSolver | WorkingSet", width: float, start: dict[str, Array]
    ) -> Guess:
        """Run one stage, and add its effort to that of the run."""
        result = method(p=np.append(run.problem.p, width), **start, **run.bounds)
        stats = method.stats()
        run.iterations += int(stats["iter_count"])
        run.evaluations += count_evaluations(stats)
        run.status = self.watch.reason or str(stats["return_status"])
        z, rows, multipliers = (np.array(result[key]).ravel() for key in ("x", "lam_g", "lam_x"))
        return Guess(primal=z, bounds=multipliers, rows=rows, width=width)

    def _judge(self, run: "_Run", guess: Guess) -> Outcome:
        """Return the outcome of the last stage."""
        return judge_point(
            self.name,
            run.problem,
            run.x0,
            self.model.point(guess.primal),
            claimed=run.status in CONVERGED,
            status=STATUS_WORDS.get(run.status, run.status.replace("_", " ").lower()) + RESTARTED * (run.restarts == 1),
            iterations=run.iterations,
            evaluations=run.evaluations,
            build_s=self.model.build_s,
            compile_s=self.create_s,
            time_s=time.perf_counter() - run.started,
            functions="compiled" if self.compiled else "interpreted",
            linear_solver=self.linear_solver,
            guess=guess,
        )

    def _estimate_smoothing(self, run: "_Run", guess: Guess) -> float:
        """Return by how much the narrowest sigmoid lowers the cost, to first order: what rows gain, at their prices."""
        wide, narrow = (np.append(run.problem.p, width) for width in (guess.width, NARROWER_WIDTHS[-1]))
        cost, rows = (
            np.array(self.functions[name](guess.primal, wide) - self.functions[name](guess.primal, narrow)).ravel()
            for name in NLP_VALUES
        )
        return float(cost[0] + guess.rows @ rows)


@dataclass(kw_only=True)
class _Run:
    """A run from one start point, and its effort so far."""

    problem: GaitProblem
    x0: Array  # (n,) start point
    bounds: dict[str, Array]  # of the NLP, by CasADi's names
    started: float = field(default_factory=lambda: time.perf_counter())
    iterations: int = 0
    evaluations: Evaluations = field(default_factory=Evaluations)
    status: str = ""  # of the last stage: IPOPT's, or why it was ended
    restarts: int = 0  # of the first stage


def _start_from(guess: Guess) -> dict[str, Array]:
    """Return a warm start, by CasADi's names."""
    return {"x0": guess.primal, "lam_x0": guess.bounds, "lam_g0": guess.rows}


@cache
def find_linear_solver(wanted: str | None = None) -> str:
    """Return the linear solver that IPOPT uses here, by its log: its default, or the wanted one; InputError if that fails."""
    x = ca.MX.sym("x")
    with make_temporary_folder("nlp-gait-ipopt-") as folder:
        log = folder / "ipopt.log"
        chosen = {} if wanted is None else {"ipopt.linear_solver": wanted}
        options = {**QUIET, "ipopt.output_file": str(log), "ipopt.file_print_level": 5, **chosen}
        probe = ca.nlpsol("probe", "ipopt", {"x": x, "f": x**2}, options)
        probe(x0=1.0)
        mentioned = re.search(r"linear solver (\S+?)[,.\s]", log.read_text() if log.exists() else "")
    used = mentioned.group(1) if mentioned else "unknown"
    status = str(probe.stats()["return_status"])
    if wanted is not None and (status != "Solve_Succeeded" or used.lower() != wanted):
        raise InputError(
            f"IPOPT's linear solver {wanted!r} does not run in this installation ({status.replace('_', ' ').lower()}; its "
            f"library may be missing); leave linear_solver out for {find_linear_solver()}"
        )
    return used
