"""The interface of an NLP solver: one run of a problem from one start point; and a callback that ends runs."""

import math
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, is_dataclass
from functools import cache
from typing import Any, ClassVar, Protocol

import casadi as ca
import numpy as np
from casadi import MX
from threadpoolctl import OpenBLASController, ThreadpoolController, register

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.interrupts import never
from nlp_gait.processes import has_fork, run_alone

INTERRUPTED, TIME_IS_UP, KILLED = "Interrupted", "Maximum_WallTime_Exceeded", "Killed"
TOO_MANY = "Maximum_Iterations_Exceeded"
REASONS = {
    INTERRUPTED: "was interrupted",
    TIME_IS_UP: "stopped at the time limit",
    TOO_MANY: "stopped at the iteration limit",
    KILLED: "was ended within an iteration, after the time limit; iterations and calls of its stage are not counted",
}
# Variables from which one iteration may outlast the time limit: of the 15,754 of stairs-track's, one took 591 s.
MANY_VARIABLES = 5000
# Iterates in a row of an attempt that may violate a row by more than its scale. Most starts of phases and cycles have at
# most 16, a few of the planned stairs 28; those with more crept for 100 to 350 iterations.
LONGEST_INFEASIBLE = 20
GRACE_S = 5.0  # after the time limit, to finish an iteration


class Solver(Protocol):
    """An NLP solver with its settings, for any problem: a frozen dataclass, whose fields are the settings.

    A new solver derives from this class and is added to ``registry.SOLVERS``. It needs ``name`` and ``run``; the other methods
    are optional. Fields named ``evaluations`` and ``time_limit_s`` are limits that a study sets.
    """

    name: ClassVar[str]

    @abstractmethod
    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        """Run the solver once from x0 (n,) within the bounds.

        ``stop`` is called between iterations, and returns whether to end at once. Without it Ctrl-C raises KeyboardInterrupt.
        """

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        """Run warm from the outcome of a neighbouring problem; None if the solver only starts cold."""
        return None

    def choose_settings(self, problem: GaitProblem, solves: int = 1) -> "Solver":
        """Return this solver with all settings that ``prepare`` would choose by the problem and the number of runs."""
        return self

    def prepare(self, problem: GaitProblem, solves: int = 1) -> "Solver":
        """Return this solver, checked and prepared for a number of runs of a problem and its copies."""
        self.check(problem)
        return self

    def check(self, problem: GaitProblem) -> None:
        """Raise InputError if a run would fail: the solver is not installed, or does not suit the problem."""
        return None

    def to_dict(self) -> dict[str, Any]:
        """Return the settings for a record."""
        return {"kind": type(self).__name__, **(asdict(self) if is_dataclass(self) else {})}


def judge_point(solver: str, problem: GaitProblem, x0: Array, x: Array, **facts: Any) -> Outcome:
    """Return the outcome at x (n,), clipped to the bounds, with the values of the exact functions."""
    x = np.clip(x, problem.lower, problem.upper)
    exact = build_exact_model(problem).at(x, problem.p)
    return Outcome(
        solver=solver,
        x0=x0,
        x=x,
        objective=problem.objective.sign * exact.cost,
        cost=exact.cost,
        violation=exact.violation,
        **facts,
    )


def count_evaluations(stats: Mapping[str, Any]) -> Evaluations:
    """Count calls by kind from CasADi's statistics; products with the Hessian count as gradients."""

    def calls(*names: str) -> int:
        return sum(int(stats.get(f"n_call_{name}", 0)) for name in names)

    return Evaluations(
        f=calls("nlp_f", "nlp_fg"),
        g=calls("nlp_g", "nlp_fg"),
        gradient=calls("nlp_grad_f", "nlp_jac_fg", "fwd1_nlp_grad_l"),
        jacobian=calls("nlp_jac_g", "nlp_jac_fg"),
        hessian=calls("nlp_hess_l"),
    )


class CasadiBlas(OpenBLASController):
    """The OpenBLAS that comes with CasADi and factorises for MUMPS; threadpoolctl does not know its name."""

    internal_api = "casadi-openblas"
    filename_prefixes = ("libcasadi-tp-openblas", "casadi-tp-openblas")


register(CasadiBlas)


@cache
def limit_casadi_threads() -> None:
    """Let CasADi's linear algebra use one thread: their number, which differs between processes, changes its rounding."""
    ThreadpoolController().select(internal_api=CasadiBlas.internal_api).limit(limits=1)


class RunLimits(threading.local):
    """Limits of the run of each thread, and why it was ended."""

    def __init__(self) -> None:
        self.stop: Callable[[], bool] = never
        self.deadline = math.inf  # a time of ``time.perf_counter`` [s]
        self.left = math.inf  # iterations
        self.seen = 0  # iterates of this stage
        self.sides: tuple[Array, Array] = (np.zeros(0), np.zeros(0))  # of the rows of this stage
        self.patience = math.inf  # iterates in a row that may violate a row by more than its scale
        self.infeasible = 0  # last iterates in a row that do
        self.reason = ""  # as IPOPT would report it
        self.send: Callable[[bytes], None] | None = None  # receives all iterates, see ``_pack_iterate``


class IterationWatch(ca.Callback):
    """CasADi's ``iteration_callback``; it does not alter the iterations, and must live as long as its solver."""

    def __init__(self, nlp: Mapping[str, MX], limits: RunLimits | None = None) -> None:
        """Make a watch for an NLP, which may share the limits of another one."""
        ca.Callback.__init__(self)
        n, m, k = (nlp[name].shape[0] for name in ("x", "g", "p"))
        self._sizes = {"x": n, "f": 1, "g": m, "lam_x": n, "lam_g": m, "lam_p": k}
        self.limits = limits or RunLimits()
        self.construct("watch", {})

    def begin(self, stop: Callable[[], bool], deadline: float, iterations: float = math.inf) -> None:
        """Watch the next run of this thread, until ``stop`` returns True or a limit of all of its stages together is reached."""
        limit_casadi_threads()
        limits = self.limits
        limits.stop, limits.deadline, limits.left, limits.seen, limits.reason = stop, deadline, iterations, 0, ""

    @property
    def reason(self) -> str:
        """Why the watch ended the run of this thread; empty if it did not."""
        return self.limits.reason

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def eval(self, iterate: Sequence[ca.DM] | None) -> list[int]:
        """Return 1 to end the run, 0 to continue."""
        limits = self.limits
        if limits.send is not None and iterate is not None:
            limits.send(_pack_iterate(dict(zip(self._sizes, iterate, strict=True))))
        limits.seen += 1  # the start point is seen, too
        if iterate is not None and limits.patience < math.inf:
            g, (lower, upper) = np.asarray(iterate[2]).ravel(), limits.sides
            violation = np.maximum(lower - g, g - upper).max(initial=0.0)
            limits.infeasible = limits.infeasible + 1 if violation > 1.0 else 0
        if limits.stop():
            limits.reason = INTERRUPTED
        elif limits.seen > limits.left:
            limits.reason = TOO_MANY
        elif time.perf_counter() >= limits.deadline:
            limits.reason = TIME_IS_UP
        return [int(bool(limits.reason) or limits.infeasible > limits.patience)]


class WatchedSolver:
    """An ``nlpsol`` with its watch, which ends it after ``patience`` infeasible iterates in a row.

    The time limit of large NLPs is kept within an iteration, too.

    These run in a forked process, which is killed if it does not return within ``GRACE_S`` after the deadline. Its last iterate
    is then the result.
    """

    def __init__(self, solver: ca.Function, watch: IterationWatch, patience: float = math.inf) -> None:
        self._solver, self._watch, self._patience = solver, watch, patience
        self._stats: Mapping[str, Any] = {}

    def stats(self) -> Mapping[str, Any]:
        """Return the statistics of the last call, by CasADi's names."""
        return self._stats

    def __call__(self, **arguments: Any) -> Mapping[str, Any]:
        """Solve the NLP."""
        result: Mapping[str, Any]
        limits = self._watch.limits
        limits.sides, limits.patience, limits.infeasible = (arguments["lbg"], arguments["ubg"]), self._patience, 0
        if len(arguments["lbx"]) >= MANY_VARIABLES and has_fork():
            result = self._call_in_fork(arguments)
        else:
            result, self._stats = self._solver(**arguments), self._solver.stats()
        limits.left, limits.seen, limits.patience = limits.left - int(self._stats["iter_count"]), 0, math.inf
        return result

    def _call_in_fork(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        limits, solver = self._watch.limits, self._solver
        n, m = len(arguments["lbx"]), len(arguments["lbg"])
        iterates = [_pack_iterate({"x": arguments["x0"], "lam_x": np.zeros(n), "lam_g": np.zeros(m)})]

        def call(send: Callable[[bytes], None]) -> dict[str, Any]:
            limits.stop, limits.send = never, send  # the parent asks
            result, stats = solver(**arguments), solver.stats()
            send(_pack_iterate(result))
            counts = {name: count for name, count in stats.items() if name.startswith("n_call_")}
            ending = {name: stats[name] for name in ("iter_count", "return_status", "success")}
            return {"reason": limits.reason, "stats": {**counts, **ending}}

        def keep(iterate: bytes) -> None:
            iterates[:] = [iterate]

        try:
            ended = run_alone(call, lambda: limits.stop() or time.perf_counter() > limits.deadline + GRACE_S, keep)
        except TimeoutError:
            reason = INTERRUPTED if limits.stop() else KILLED
            ended = {"reason": reason, "stats": {"iter_count": 0, "return_status": reason, "success": False}}
        limits.reason, self._stats = ended["reason"], ended["stats"]
        x, lam_x, lam_g = np.split(np.frombuffer(iterates[-1]), (n, 2 * n))
        return {"x": x, "lam_x": lam_x, "lam_g": lam_g}


def _pack_iterate(values: Mapping[str, Any]) -> bytes:
    """Return x and the multipliers, from which the next stage starts, by CasADi's names."""
    return np.concatenate([np.asarray(values[name], dtype=float).ravel() for name in ("x", "lam_x", "lam_g")]).tobytes()
