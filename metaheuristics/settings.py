"""Validation of settings: one message form for all of them."""

from __future__ import annotations

import math
import sys
from dataclasses import MISSING, fields
from importlib.util import find_spec
from numbers import Integral, Real
from operator import ge, gt, le
from typing import TYPE_CHECKING, Any

from metaheuristics.errors import SearchError, abbreviate

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

COMPARISONS = {">": gt, ">=": ge, "<=": le}


def check_number(
    settings: DataclassInstance,
    *names: str,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
) -> None:
    """Raise SearchError unless fields are finite numbers within the limits; ``above`` is exclusive."""
    limits = {">": above, ">=": at_least, "<=": at_most}
    given = " and ".join(f"{sign} {limit}" for sign, limit in limits.items() if limit is not None)
    for name in names:
        value: Any = getattr(settings, name)
        number = isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
        if not number or any(
            limit is not None and not COMPARISONS[sign](value, limit) for sign, limit in limits.items()
        ):
            raise bad_setting(settings, name, f"a finite number {given}".strip())


def check_count(settings: DataclassInstance, name: str, *, at_least: int, at_most: int | None = None) -> None:
    """Raise SearchError unless a field is a whole number within the inclusive limits."""
    value = getattr(settings, name)
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not whole or value < at_least or (at_most is not None and value > at_most):
        upper = "" if at_most is None else f" and <= {at_most}"
        raise bad_setting(settings, name, f"a whole number >= {at_least}{upper}")


def is_installed(package: str) -> bool:
    """Whether a package can be imported."""
    return find_spec(package) is not None


def check_installed(algorithm: str, package: str) -> None:
    """Raise SearchError unless the package that an algorithm comes from is installed."""
    if not is_installed(package):
        extra = "bayes" if package == "egobox" else "algorithms"
        raise SearchError(
            f"algorithm {algorithm!r} needs the package {package}, which is not installed: "
            f"pip install 'nlp-gait[{extra}]'"
        )
    if package == "cma" and sys.flags.optimize > 1:
        raise SearchError(f"algorithm {algorithm!r} needs docstrings: run Python without -OO and PYTHONOPTIMIZE=2")


def bad_setting(settings: DataclassInstance, name: str, allowed: str) -> SearchError:
    """Return the error for a field, to be raised by the caller; ``allowed`` follows "must be"."""
    message = f"{type(settings).__name__}: {name} must be {allowed}, got {abbreviate(getattr(settings, name))}"
    default = next(field.default for field in fields(settings) if field.name == name)
    return SearchError(message if default is MISSING else f"{message}; leave it out for the default, {default!r}")
