"""One lock for all that CasADi does in this process, so that problems may be used from several threads.

CasADi lets go of Python's lock while it works, and solvers that it brings (MUMPS) keep what they compute with in global memory:
two solves at once end in wrong verdicts or in a crash, also on different problems. Compiled kernels need no lock.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

CASADI_LOCK = threading.RLock()


def lock_casadi(call: Callable[P, T]) -> Callable[P, T]:
    """The same function, entered by one thread at a time among all functions that this was done to."""

    @wraps(call)
    def alone(*positional: P.args, **named: P.kwargs) -> T:
        with CASADI_LOCK:
            return call(*positional, **named)

    return alone


if hasattr(os, "register_at_fork"):
    # A fork waits until no other thread is inside CasADi: the child, which has this thread only, could never finish its work.
    os.register_at_fork(
        before=CASADI_LOCK.acquire, after_in_parent=CASADI_LOCK.release, after_in_child=CASADI_LOCK.release
    )
