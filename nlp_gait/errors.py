"""Errors that a user can act on: each says what, the value, what is allowed and the remedy."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Iterable
from functools import cache
from numbers import Integral

LONGEST_VALUE = 80  # characters of a value in a message

# Warns in words and what they are about, as ``logging`` takes them, once in a process however often a file is read.
warn_once = cache(logging.getLogger("nlp_gait").warning)


class GaitError(Exception):
    """Root of every error that this package raises on purpose; its message is one line, whatever the values in it are."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(" ".join(part.splitlines()) if isinstance(part, str) else part for part in arguments))


class UnknownNameError(GaitError):
    """A problem, robot, variable, parameter, algorithm or option that does not exist."""


class RobotDataError(GaitError):
    """Robot data that is damaged or physically impossible."""


class InputError(GaitError):
    """A value that is not allowed: wrong length, not finite, outside its bounds, bounds inverted."""


class UserCodeError(InputError):
    """User code that cannot be found, was not named, or fails."""


class CompilerError(GaitError):
    """The compiled backend was demanded and cannot be had."""


class LiftedSenseError(GaitError):
    """A non-smooth operation was lifted where the reformulation is not exact."""


class MissingExtraError(GaitError):
    """A feature that needs an optional package which is not installed."""


class OutputError(GaitError):
    """A result cannot be written where it was asked for."""


class WorkerError(GaitError):
    """Worker processes die, or do not begin."""


def unknown(kind: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """Error for an unknown name, with the nearest known ones.

    Args:
        kind: what was looked up, for example ``"problem"``.
        name: what the user gave.
        known: all allowed names.
    """
    if not isinstance(name, str):
        return UnknownNameError(f"the name of {_a(kind)} must be a text, got {format_value(name)}")
    choices = sorted(known)
    near = difflib.get_close_matches(name, choices, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known: {', '.join(choices)}"
    return UnknownNameError(f"unknown {kind} {name!r}; {hint}")


def _a(kind: str) -> str:
    """With its article."""
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


def check_name(kind: str, name: object) -> None:
    """Raise InputError unless what should name a problem, a solver or the like is a text."""
    if not isinstance(name, str):
        raise InputError(f"the name of {_a(kind)} must be a text, got {format_value(name)}")


def check_count(name: str, value: object, *, at_least: int = 1, at_most: int | None = None) -> int:
    """A whole number within limits, NumPy's too; True and False are none.

    Args:
        name: of the argument, for the message.
        value: as it was given.
        at_least: smallest that is allowed.
        at_most: largest; None for no limit.

    Raises:
        InputError: it is something else.
    """
    whole = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if whole is None or whole < at_least or (at_most is not None and whole > at_most):
        limit = "" if at_most is None else f" and <= {at_most}"
        raise InputError(f"{name} must be a whole number >= {at_least}{limit}, got {format_value(value)}")
    return whole


def format_value(value: object) -> str:
    """A value in a message: short, and whatever it is."""
    try:
        text = repr(value)
    except Exception:  # somebody else's class; or a whole number too long to print
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."


def describe_type(kind: type) -> str:
    """What a value of a type is called to its user: ``a whole number`` for int."""
    names = {
        bool: "true or false",
        int: "a whole number",
        float: "a finite number",
        str: "a text",
        dict: "a table",
        list: "a list",
    }
    return names.get(kind, kind.__name__)
