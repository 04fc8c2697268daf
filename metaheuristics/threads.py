"""Threads of linear algebra: their number changes the rounding of LAPACK, and so the points of a search."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


def limit_blas_threads() -> AbstractContextManager[object]:
    """Return a context in which NumPy's and SciPy's BLAS and LAPACK use one thread, so that equal seeds give equal bits."""
    limits: AbstractContextManager[object] = _find_libraries().limit(limits=1, user_api="blas")
    return limits


@cache
def _find_libraries() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  SciPy's LAPACK is not NumPy's; only loaded libraries are found

    return ThreadpoolController()
