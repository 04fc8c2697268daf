"""Errors of this package, and validation of settings: one message form for all of them."""

from __future__ import annotations

import math
import sys
from dataclasses import MISSING, fields
from functools import partial
from importlib.util import find_spec
from numbers import Integral, Real
from operator import ge, gt, le
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


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


COMPARISONS = {">": gt, ">=": ge, "<=": le}


def is_number(value: object, kind: type = Real) -> bool:
    """Whether a value is a real number, or one of another kind; True and False are none."""
    return isinstance(value, kind) and not isinstance(value, bool)


def check_number(
    settings: DataclassInstance,
    *names: str,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    whole: bool = False,
) -> None:
    """Raise SearchError unless fields are finite or whole numbers within the limits; ``above`` is exclusive."""
    limits = {sign: end for sign, end in ((">", above), (">=", at_least), ("<=", at_most)) if end is not None}
    allowed = f"a {'whole' if whole else 'finite'} number {' and '.join(f'{sign} {limits[sign]}' for sign in limits)}"
    for name in names:
        value: Any = getattr(settings, name)
        number = is_number(value, Integral if whole else Real) and (whole or math.isfinite(value))
        if not number or not all(COMPARISONS[sign](value, limit) for sign, limit in limits.items()):
            raise bad_setting(settings, name, allowed.strip())


check_count = partial(check_number, whole=True)


def is_installed(package: str) -> bool:
    """Whether a package can be imported."""
    return find_spec(package) is not None


def check_installed(algorithm: str, package: str) -> None:
    """Raise SearchError unless the package that an algorithm comes from is installed."""
    if not is_installed(package):
        raise SearchError(
            f"algorithm {algorithm!r} needs the package {package}, which is not installed: pip install 'nlp-gait[algorithms]'"
        )
    if package == "cma" and sys.flags.optimize > 1:
        raise SearchError(f"algorithm {algorithm!r} needs docstrings: run Python without -OO and PYTHONOPTIMIZE=2")


def bad_setting(settings: DataclassInstance, name: str, allowed: str) -> SearchError:
    """Return the error for a field, to be raised by the caller; ``allowed`` follows "must be"."""
    message = f"{type(settings).__name__}: {name} must be {allowed}, got {abbreviate(getattr(settings, name))}"
    default = next(field.default for field in fields(settings) if field.name == name)
    return SearchError(message if default is MISSING else f"{message}; leave it out for the default, {default!r}")
