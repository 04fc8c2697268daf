"""A callback that ends an NLP solver between two iterations, at the time limit or on request."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping

import casadi as ca
from casadi import MX

from nlp_gait.interrupts import never

INTERRUPTED, TIME_IS_UP = "Interrupted", "Maximum_WallTime_Exceeded"
REASONS = {INTERRUPTED: "was interrupted", TIME_IS_UP: "stopped at the time limit"}


class IterationWatch(ca.Callback):
    """CasADi's ``iteration_callback``; it does not alter the iterations, and must live as long as its solver."""

    def __init__(self, nlp: Mapping[str, MX], shared: IterationWatch | None = None) -> None:
        """Make a watch for an NLP.

        Args:
            nlp: CasADi's dictionary of x, p, f, g.
            shared: another watch, whose ``begin`` applies to this one too.
        """
        ca.Callback.__init__(self)
        n, m, k = (nlp[name].shape[0] for name in ("x", "g", "p"))
        self._sizes = {"x": n, "f": 1, "g": m, "lam_x": n, "lam_g": m, "lam_p": k}
        self._of_thread: threading.local = threading.local() if shared is None else shared._of_thread
        self.construct("watch", {})

    def begin(self, stop: Callable[[], bool], deadline: float) -> None:
        """Watch the next run of this thread.

        Args:
            stop: returns whether the run should end.
            deadline: of ``time.perf_counter`` [s].
        """
        self._of_thread.stop, self._of_thread.deadline, self._of_thread.reason = stop, deadline, ""

    @property
    def reason(self) -> str:
        """Why the watch ended the run of this thread, as IPOPT would report it; empty if it did not."""
        return getattr(self._of_thread, "reason", "")

    def get_n_in(self) -> int:
        """See ``casadi.Callback``."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """See ``casadi.Callback``."""
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """See ``casadi.Callback``."""
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
