"""Errors for users: each message gives what is wrong, the value, what is allowed and what to do."""

import difflib
import errno
import logging
from collections.abc import Iterable
from functools import cache
from numbers import Integral
from types import NoneType

LONGEST_VALUE = 80  # characters of a value in a message
# Types in messages about data files.
WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", NoneType: "null"}

# Takes the arguments of ``logging``; warns once per process, however often a file is read.
warn_once = cache(logging.getLogger("nlp_gait").warning)


class GaitError(Exception):
    """Base class of all errors that this package raises on purpose; the message is one line, whatever the values in it."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(
            *(" ".join(argument.splitlines()) if isinstance(argument, str) else argument for argument in arguments)
        )


class UnknownNameError(GaitError):
    """A problem, robot, variable, parameter, algorithm or option that does not exist."""


class RobotDataError(GaitError):
    """Robot data that is damaged or physically impossible."""


class InputError(GaitError):
    """A value that is not allowed: wrong length, not finite, outside its bounds, bounds inverted."""


class UserCodeError(InputError):
    """User code that cannot be found, was not named, or fails."""


class CompilerError(GaitError):
    """The compiled backend was required and is not available."""


class LiftedSenseError(GaitError):
    """A non-smooth operation was lifted where the reformulation is not exact."""


class MissingExtraError(GaitError):
    """A feature whose optional package is not installed."""


class OutputError(GaitError):
    """A result cannot be written to the given place."""


class WorkerError(GaitError):
    """Worker processes die or do not start."""


class NoWorkersError(WorkerError):
    """Worker processes cannot begin: to try again would not help."""


def unknown(kind: str, name: object, known: Iterable[str]) -> UnknownNameError:
    """Return the error for an unknown name of a kind, for example ``"problem"``, with the nearest of all known names."""
    if not isinstance(name, str):
        article = "an" if kind[0] in "aeiou" else "a"
        return UnknownNameError(f"the name of {article} {kind} must be a text, got {format_value(name)}")
    choices = sorted(known)
    near = difflib.get_close_matches(name, choices, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known: {', '.join(choices)}"
    return UnknownNameError(f"unknown {kind} {name!r}; {hint}")


def check_name(kind: str, name: object) -> None:
    """Raise InputError unless the name of a problem, solver or the like is a text."""
    if not isinstance(name, str):
        raise InputError(str(unknown(kind, name, ())))


def check_count(name: str, value: object, *, at_least: int = 1, at_most: int | None = None) -> int:
    """Return a whole number within limits, also one of NumPy; raises InputError, also for True and False."""
    whole = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if whole is None or whole < at_least or (at_most is not None and whole > at_most):
        limit = "" if at_most is None else f" and <= {at_most}"
        raise InputError(f"{name} must be a whole number >= {at_least}{limit}, got {format_value(value)}")
    return whole


def check_choice(name: str, value: object, choices: Iterable[object]) -> None:
    """Raise InputError unless a value is one of the choices."""
    known = list(choices)
    if not any(value == choice and type(value) is type(choice) for choice in known):
        raise InputError(f"{name} must be one of {', '.join(map(repr, known))}, got {format_value(value)}")


def format_value(value: object) -> str:
    """Return a short text of any value, for messages."""
    try:
        text = repr(value)
    except Exception:  # of a foreign class, or of an integer too long to print
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."


def describe_type(kind: type) -> str:
    """Return a type in words, for messages: ``a whole number`` for int."""
    return {**WORDS, float: "a finite number", dict: "a table", list: "a list"}.get(kind, kind.__name__)


NO_MEMORY = ("failed to map segment", "std::bad_alloc")  # in errors of the dynamic loader and of C++


def describe_shortage(error: BaseException | None) -> str | None:
    """Return which resource of the system is used up, by an error or its causes; None for any other error."""
    while error is not None:
        number, text = getattr(error, "errno", None), str(error)
        if isinstance(error, MemoryError) or number == errno.ENOMEM or any(words in text for words in NO_MEMORY):
            return "there is not enough memory"
        if number in (errno.EMFILE, errno.ENFILE):
            return "too many files are open"
        if number == errno.EAGAIN or "can't start new thread" in text:
            return "there are too many processes or threads"
        error = error.__cause__ or error.__context__
    return None
