"""Gait problems by name."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable

from nlp_gait.errors import unknown
from nlp_gait.problems.gait_problem import GaitProblem

# Module and function of each problem, imported when it is asked for: no process pays for those that it does not use.
PROBLEMS = {
    "nao-ssp": "nao_ssp",
    "nao-dsp": "nao_dsp",
    "walk12": "walk12",
    "stairs-plan": "stairs_plan",
    "stairs-track": "stairs_track",
    "stairs-ideal": "stairs_ideal",
}


def problem_names() -> tuple[str, ...]:
    """Names of the problems that come with the package."""
    return tuple(PROBLEMS)


def problem_maker(name: str) -> Callable[..., GaitProblem]:
    """Function that makes a problem; its keyword arguments are the problem's options.

    Raises:
        UnknownNameError: no such problem.
    """
    if name not in PROBLEMS:
        raise unknown("problem", name, PROBLEMS)
    make: Callable[..., GaitProblem] = getattr(
        importlib.import_module(f"nlp_gait.problems.{PROBLEMS[name]}"), PROBLEMS[name]
    )
    return make


def load(name: str, **options: str | int | float | bool) -> GaitProblem:
    """Problem by name, built with the given options; the others keep their defaults.

    Raises:
        UnknownNameError: no such problem or option.
        InputError: a value that the option does not allow.
    """
    make = problem_maker(name)
    known = inspect.signature(make).parameters
    for option in options:
        if option not in known:
            raise unknown(f"option of {name}", option, known)
    return make(**options)


__all__ = ["PROBLEMS", "GaitProblem", "load", "problem_maker", "problem_names"]
