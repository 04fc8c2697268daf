"""Errors of this package."""


class SearchError(Exception):
    """A setting, a problem or a result of the objective that no search can use.

    The message says what is wrong, the value, what is allowed and what to do. Poor convergence and failed evaluations
    are not errors: they are data in `Result`. The message is always one line.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(
            *(" ".join(argument.splitlines()) if isinstance(argument, str) else argument for argument in arguments)
        )


LONGEST_VALUE = 80  # characters of a value in a message


def abbreviate(value: object) -> str:
    """Return a short text of any value for a message."""
    try:
        text = repr(value)
    except Exception:  # a class with a broken repr, or a whole number too long to print
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."
