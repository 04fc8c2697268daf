"""Gait problems by name."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from typing import Any

from nlp_gait.errors import InputError, kind_name, unknown
from nlp_gait.problem.gait_problem import GaitProblem, is_number

# Module and function of each problem, imported when it is asked for: no process pays for those that it does not use.
PROBLEMS = {
    "nao-ssp": ("nao.single_support", "nao_ssp"),
    "nao-dsp": ("nao.double_support", "nao_dsp"),
    "nao-ssp-free": ("nao.single_support_free", "nao_ssp_free"),
    "nao-dsp-free": ("nao.double_support_free", "nao_dsp_free"),
    "nao-cycle": ("nao.cycle", "nao_cycle"),
    "walk12": ("walk12.problem", "walk12"),
    "stairs-plan": ("stairs.plan", "stairs_plan"),
    "stairs-track": ("stairs.track", "stairs_track"),
    "stairs-ideal": ("stairs.ideal", "stairs_ideal"),
}

# Intervals and samples beyond this have no use, and a problem of that size is not built in any time.
LARGEST_COUNT = 10_000


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
    module, maker = PROBLEMS[name]
    make: Callable[..., GaitProblem] = getattr(importlib.import_module(f"nlp_gait.problems.{module}"), maker)
    return make


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Refuse options of a problem that do not exist, or are not of their default's type.

    Raises:
        UnknownNameError: no such problem or option.
        InputError: a value of another type, or a count beyond what can be built.
    """
    known = inspect.signature(problem_maker(name)).parameters
    for option, value in options.items():
        if option not in known:
            raise unknown(f"option of {name}", option, known)
        expected = type(known[option].default)
        right = type(value) is expected or (expected is float and type(value) is int)
        if not right or (expected is float and not is_number(value)):
            raise InputError(f"option {option} must be {kind_name(expected)}, got {value!r}")
        if expected is int and value > LARGEST_COUNT:
            raise InputError(f"option {option} must be at most {LARGEST_COUNT}, got {value}")


def load(name: str, /, **options: str | int | float | bool) -> GaitProblem:
    """Problem by name, built with the given options; the others keep their defaults.

    Raises:
        UnknownNameError: no such problem or option.
        InputError: a value that the option does not allow.
    """
    make = problem_maker(name)
    check_options(name, options)
    return make(**options)


__all__ = ["PROBLEMS", "GaitProblem", "check_options", "load", "problem_maker", "problem_names"]
