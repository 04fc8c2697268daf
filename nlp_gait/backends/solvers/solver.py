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
LARGE = 5000
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


class IterationWatch(ca.Callback):
    """CasADi's ``iteration_callback``; it does not alter the iterations, and must live as long as its solver."""

    def __init__(self, nlp: Mapping[str, MX], shared: "IterationWatch | None" = None) -> None:
        """Make a watch for an NLP, to which ``begin`` of another watch applies if it is shared."""
        ca.Callback.__init__(self)
        n, m, k = (nlp[name].shape[0] for name in ("x", "g", "p"))
        self._sizes = {"x": n, "f": 1, "g": m, "lam_x": n, "lam_g": m, "lam_p": k}
        self._of_thread: threading.local = threading.local() if shared is None else shared._of_thread
        self.construct("watch", {})

    def begin(self, stop: Callable[[], bool], deadline: float, iterations: float = math.inf) -> None:
        """Watch the next run of this thread, until ``stop`` returns True.

        ``deadline``, a time of ``time.perf_counter`` [s], and ``iterations`` are limits of all its stages together.
        """
        limit_casadi_threads()
        self._of_thread.stop, self._of_thread.deadline, self._of_thread.reason = stop, deadline, ""
        self._of_thread.left, self._of_thread.seen = iterations, 0

    def count(self, iterations: int) -> None:
        """Count the iterations of a finished stage."""
        self._of_thread.left, self._of_thread.seen = self._of_thread.left - iterations, 0

    def end(self, reason: str) -> None:
        """Say why the run of this thread ends."""
        self._of_thread.reason = reason

    def send_iterates(self, send: Callable[[bytes], None]) -> None:
        """Send all iterates of this thread's run, see ``_pack_iterate``; ``stop`` is asked no more."""
        self._of_thread.stop, self._of_thread.send = never, send

    @property
    def stop(self) -> Callable[[], bool]:
        """Whether to end the run of this thread at once."""
        stop: Callable[[], bool] = getattr(self._of_thread, "stop", never)
        return stop

    @property
    def deadline(self) -> float:
        """Of the run of this thread, a time of ``time.perf_counter`` [s]."""
        deadline: float = getattr(self._of_thread, "deadline", math.inf)
        return deadline

    @property
    def reason(self) -> str:
        """Why the watch ended the run of this thread, as IPOPT would report it; empty if it did not."""
        return getattr(self._of_thread, "reason", "")

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def eval(self, iterate: Sequence[ca.DM] | None) -> list[int]:
        """Return 1 to end the run, 0 to continue."""
        send = getattr(self._of_thread, "send", None)
        if send is not None and iterate is not None:
            send(_pack_iterate(dict(zip(self._sizes, iterate, strict=True))))
        self._of_thread.seen += 1  # the start point is seen, too
        if self.stop():
            self.end(INTERRUPTED)
        elif self._of_thread.seen > self._of_thread.left:
            self.end(TOO_MANY)
        elif time.perf_counter() >= self.deadline:
            self.end(TIME_IS_UP)
        return [int(bool(self.reason))]


class WatchedSolver:
    """An ``nlpsol`` with its watch, which keeps the time limit of large NLPs within an iteration, too.

    These run in a forked process, which is killed if it does not return within ``GRACE_S`` after the deadline. Its last iterate
    is then the result.
    """

    def __init__(self, solver: ca.Function, watch: IterationWatch) -> None:
        self._solver, self._watch = solver, watch
        self._stats: Mapping[str, Any] = {}

    def stats(self) -> Mapping[str, Any]:
        """Return the statistics of the last call, by CasADi's names."""
        return self._stats

    def __call__(self, **arguments: Any) -> Mapping[str, Any]:
        """Solve the NLP."""
        result: Mapping[str, Any]
        if len(arguments["lbx"]) >= LARGE and has_fork():
            result = self._call_in_fork(arguments)
        else:
            result, self._stats = self._solver(**arguments), self._solver.stats()
        self._watch.count(int(self._stats["iter_count"]))
        return result

    def _call_in_fork(self, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
        watch, solver = self._watch, self._solver
        n, m = len(arguments["lbx"]), len(arguments["lbg"])
        iterates = [_pack_iterate({"x": arguments["x0"], "lam_x": np.zeros(n), "lam_g": np.zeros(m)})]

        def call(send: Callable[[bytes], None]) -> dict[str, Any]:
            watch.send_iterates(send)
            result, stats = solver(**arguments), solver.stats()
            send(_pack_iterate(result))
            counts = {name: count for name, count in stats.items() if name.startswith("n_call_")}
            ending = {name: stats[name] for name in ("iter_count", "return_status", "success")}
            return {"reason": watch.reason, "stats": {**counts, **ending}}

        def keep(iterate: bytes) -> None:
            iterates[:] = [iterate]

        try:
            ended = run_alone(call, lambda: watch.stop() or time.perf_counter() > watch.deadline + GRACE_S, keep)
        except TimeoutError:
            reason = INTERRUPTED if watch.stop() else KILLED
            ended = {"reason": reason, "stats": {"iter_count": 0, "return_status": reason, "success": False}}
        watch.end(ended["reason"])
        self._stats = ended["stats"]
        x, lam_x, lam_g = np.split(np.frombuffer(iterates[-1]), (n, 2 * n))
        return {"x": x, "lam_x": lam_x, "lam_g": lam_g}


def _pack_iterate(values: Mapping[str, Any]) -> bytes:
    """Return x and the multipliers, from which the next stage starts, by CasADi's names."""
    return np.concatenate([np.asarray(values[name], dtype=float).ravel() for name in ("x", "lam_x", "lam_g")]).tobytes()
