"""Objects of a user's own as algorithms: settings or a class of settings, a function that makes them, or a plain function."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from typing import Any

from metaheuristics.adapters.function import ARGUMENTS, PlainFunction, takes_function_arguments
from metaheuristics.errors import SearchError
from metaheuristics.interface import Algorithm
from metaheuristics.preparation import check_population


def as_algorithm(own: Any, name: str, settings: Mapping[str, Any] | None = None) -> Algorithm:
    """The algorithm that an object is or makes.

    Args:
        own: an `Algorithm`; a class or function that makes one from keyword settings; or a plain function
            `minimise(f, lower, upper, evaluations, seed)`, see `PlainFunction`.
        name: what to call it in messages.
        settings: that differ from its defaults.

    Raises:
        SearchError: it is none of these, or does not take the settings.
    """
    settings = dict(settings or {})
    made: Any
    if hasattr(own, "start") and not isinstance(own, type):
        if settings and not (is_dataclass(own) and not isinstance(own, type)):
            raise SearchError(f"algorithm {name!r} takes no settings, got {', '.join(settings)}: it is no data class")
        made = replace(own, **settings) if settings else own
    elif callable(own) and not isinstance(own, type) and takes_function_arguments(own, settings):
        made = PlainFunction(function=own, name=name, settings=settings)
    elif callable(own):
        try:
            inspect.signature(own).bind(**settings)
        except (TypeError, ValueError) as error:
            wanted = f"a plain function takes ({', '.join(ARGUMENTS)}); what makes an algorithm takes its settings by keyword"
            raise SearchError(f"{name!r} cannot be called as an algorithm: {error}; {wanted}") from error
        made = own(**settings)
    else:
        made = own
    return checked_algorithm(made, name)


def checked_algorithm(made: Any, name: str) -> Algorithm:
    """The algorithm, if the loop can run it.

    Raises:
        SearchError: it has no `start`, or its population is no whole number >= 1.
    """
    if not callable(getattr(made, "start", None)):
        raise SearchError(
            f"{name!r} must be an algorithm with `population` and `start`, or a plain function of ({', '.join(ARGUMENTS)}); "
            f"got {type(made).__name__}"
        )
    check_population(made, name)
    algorithm: Algorithm = made
    return algorithm
