"""How a problem is made again, in this process or in another one: it is pickled as its maker, that one's options, and values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from nlp_gait.errors import InputError
from nlp_gait.formulation.locking import one_at_a_time

if TYPE_CHECKING:
    from nlp_gait.formulation.gait_problem import GaitProblem


class Origin(NamedTuple):
    """What makes a problem.

    Attributes:
        make: with keyword options.
        options: all of them.
    """

    make: Callable[..., GaitProblem]
    options: Mapping[str, Any]


def pickled(problem: GaitProblem, origin: Origin | None) -> tuple[Callable[..., GaitProblem], tuple[Any, ...]]:
    """What pickle keeps of a problem: a function and its arguments.

    Raises:
        InputError: no maker that other processes could find makes exactly this problem.
    """
    if origin is None or "<locals>" in getattr(origin.make, "__qualname__", ""):
        raise InputError(
            f"problem {problem.name!r} cannot be pickled: it is not what a maker makes from options, or its maker is no "
            "function at the top of a module; make it in the other process, or give it a maker there"
        )
    return remade, (origin.make, origin.options, dict(problem.values), repr(problem.display.robot))


def remade(
    make: Callable[..., GaitProblem], options: Mapping[str, Any], values: Mapping[str, float], robot: str
) -> GaitProblem:
    """A problem that was pickled; copies of one problem share what is built, here too.

    Raises:
        InputError: the robot's file holds another robot than it did.
    """
    return _remade(make, tuple(sorted(options.items())), robot).with_values(**values)


@one_at_a_time
@lru_cache(maxsize=16)
def _remade(make: Callable[..., GaitProblem], options: tuple[tuple[str, Any], ...], robot: str) -> GaitProblem:
    problem = make(**dict(options))
    if repr(problem.display.robot) != robot:
        raise InputError(
            f"problem {problem.name!r}: its robot is another one than when it was pickled: its file has changed"
        )
    return problem
