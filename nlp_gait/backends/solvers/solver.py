"""The interface of an NLP solver: one run of a problem from one start point; and a callback that ends runs."""

import math
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Mapping
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

INTERRUPTED, TIME_IS_UP = "Interrupted", "Maximum_WallTime_Exceeded"
REASONS = {INTERRUPTED: "was interrupted", TIME_IS_UP: "stopped at the time limit"}


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

    def begin(self, stop: Callable[[], bool], deadline: float) -> None:
        """Watch the next run of this thread, until ``stop`` returns True or a deadline of ``time.perf_counter`` [s]."""
        limit_casadi_threads()
        self._of_thread.stop, self._of_thread.deadline, self._of_thread.reason = stop, deadline, ""

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

    def eval(self, iterate: object) -> list[int]:
        """Return 1 to end the run, 0 to continue."""
        stop = getattr(self._of_thread, "stop", never)
        deadline = getattr(self._of_thread, "deadline", math.inf)
        if stop():
            self._of_thread.reason = INTERRUPTED
        elif time.perf_counter() >= deadline:
            self._of_thread.reason = TIME_IS_UP
        return [int(bool(self.reason))]
