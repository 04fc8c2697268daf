"""The root of the errors that this package raises on purpose."""

from __future__ import annotations


class SearchError(Exception):
    """A setting, a problem or an answer of the objective that no search can work with.

    The message says what is wrong, the value, what is allowed and what to do. Poor convergence and failed evaluations
    are not errors: they are data in `Result`. The message is one line, whatever the values in it are.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(" ".join(part.splitlines()) if isinstance(part, str) else part for part in arguments))


LONGEST_VALUE = 80  # characters of a value in a message


def shown(value: object) -> str:
    """A value in a message: short, and whatever it is."""
    try:
        text = repr(value)
    except Exception:  # somebody else's class; or a whole number too long to print
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."
