"""Errors that a user can act on: each says what, the value, what is allowed and the remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class GaitError(Exception):
    """Root of every error that this package raises on purpose."""


class UnknownNameError(GaitError):
    """A problem, robot, variable, parameter, algorithm or option that does not exist."""


class RobotDataError(GaitError):
    """Robot data that is damaged or physically impossible."""


class InputError(GaitError):
    """A value that is not allowed: wrong length, not finite, outside its bounds, bounds inverted."""


class OwnCodeError(InputError):
    """Code of one's own that cannot be found, was not named, or fails."""


class CompilerError(GaitError):
    """The compiled backend was demanded and cannot be had."""


class LiftedSenseError(GaitError):
    """A non-smooth operation was lifted where the reformulation is not exact."""


class MissingExtraError(GaitError):
    """A feature that needs an optional package which is not installed."""


class OutputError(GaitError):
    """A result cannot be written where it was asked for."""


class WorkerError(GaitError):
    """Worker processes of a study keep dying."""


def unknown(kind: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """Error for an unknown name, with the nearest known ones.

    Args:
        kind: what was looked up, for example ``"problem"``.
        name: what the user gave.
        known: all allowed names.
    """
    choices = sorted(known)
    near = difflib.get_close_matches(name, choices, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known: {', '.join(choices)}"
    return UnknownNameError(f"unknown {kind} {name!r}; {hint}")


def kind_name(kind: type) -> str:
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
