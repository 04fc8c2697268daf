"""The root of the errors that this package raises on purpose."""

from __future__ import annotations


class SearchError(Exception):
    """A setting, a problem or an answer of the objective that no search can work with.

    The message says what is wrong, the value, what is allowed and what to do. Poor convergence and failed evaluations
    are not errors: they are data in `Result`.
    """
