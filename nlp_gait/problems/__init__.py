"""Gait problems by name."""

from __future__ import annotations

import inspect
from collections.abc import Callable

from nlp_gait.errors import unknown
from nlp_gait.problems.gait_problem import GaitProblem
from nlp_gait.problems.nao_dsp import nao_dsp
from nlp_gait.problems.nao_ssp import nao_ssp
from nlp_gait.problems.stairs_ideal import stairs_ideal
from nlp_gait.problems.stairs_plan import stairs_plan
from nlp_gait.problems.stairs_track import stairs_track
from nlp_gait.problems.walk12 import walk12

PROBLEMS: dict[str, Callable[..., GaitProblem]] = {
    "nao-ssp": nao_ssp,
    "nao-dsp": nao_dsp,
    "walk12": walk12,
    "stairs-plan": stairs_plan,
    "stairs-track": stairs_track,
    "stairs-ideal": stairs_ideal,
}


def problem_names() -> tuple[str, ...]:
    """Names of the problems that come with the package."""
    return tuple(PROBLEMS)


def load(name: str, **options: str | int | float | bool) -> GaitProblem:
    """Problem by name, built with the given options; the others keep their defaults.

    Raises:
        UnknownNameError: no such problem or option.
        InputError: a value that the option does not allow.
    """
    if name not in PROBLEMS:
        raise unknown("problem", name, PROBLEMS)
    make = PROBLEMS[name]
    known = inspect.signature(make).parameters
    for option in options:
        if option not in known:
            raise unknown(f"option of {name}", option, known)
    return make(**options)


__all__ = ["PROBLEMS", "GaitProblem", "load", "problem_names"]
