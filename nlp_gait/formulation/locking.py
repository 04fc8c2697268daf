"""One process-wide lock around CasADi, so that several threads can use problems, and a cache that builds under it.

CasADi releases Python's lock while it works, and solvers in its wheel (MUMPS) use global memory: two solves at once give wrong
results or crash, also on different problems. Compiled kernels need no lock.
"""

import os
import threading
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

CASADI_LOCK = threading.RLock()


def lock_casadi(call: Callable[P, T]) -> Callable[P, T]:
    """Serialise a function with all others that have this decorator."""

    @wraps(call)
    def call_locked(*positional: P.args, **named: P.kwargs) -> T:
        with CASADI_LOCK:
            return call(*positional, **named)

    return call_locked


class Cache:
    """Values that were built from a problem's mathematics, each by one thread."""

    def __init__(self) -> None:
        self._values: dict[Hashable, Any] = {}

    def get(self, key: Hashable, build: Callable[[], T]) -> T:
        """Return the value of a key, built on the first call."""
        if key not in self._values:
            with CASADI_LOCK:
                if key not in self._values:  # another thread may have built it meanwhile
                    self._values[key] = build()
        value: T = self._values[key]
        return value


if hasattr(os, "register_at_fork"):
    # A fork waits until no other thread is inside CasADi: the child has this thread only and could not finish the others' work.
    release = CASADI_LOCK.release
    os.register_at_fork(before=CASADI_LOCK.acquire, after_in_parent=release, after_in_child=release)
