"""Skeleton of a result: its time histories as the problem draws them."""

from __future__ import annotations

from dataclasses import replace

from nlp_gait.errors import InputError
from nlp_gait.formulation import Result, sample_signals
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.stick_figure import Skeleton


@lock_casadi
def make_skeleton(result: Result, frames_per_s: float) -> Skeleton:
    """Skeleton of a gait at about the given number of samples a second.

    Raises:
        InputError: the problem has no motion to draw.
    """
    problem = result.problem
    if problem.display.skeleton is None:
        raise InputError(f"problem {problem.name!r} has no skeleton to draw")
    drawn = problem.display.skeleton(sample_signals(result, 1.0 / frames_per_s), problem.parameter_values)
    return replace(drawn, title=problem.title)
