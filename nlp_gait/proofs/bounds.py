"""What branch and bound needs of a problem, and which bounds a problem has."""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.proofs.boxes import Assessed, BoxBounds
from nlp_gait.proofs.power_bounds import PowerBounds
from nlp_gait.proofs.power_form import has_power_form


class Bounds(Protocol):
    """Bounds over boxes of places, which are points x in some coordinates.

    Attributes:
        whole: (1, n, 2) box that holds the places of all x within their bounds.
    """

    whole: Array

    def place(self, x: Array) -> Array:
        """(P, n) places of points (P, n)."""

    def assess(self, boxes: Array, target: float) -> Assessed:
        """What is left of boxes (P, n, 2) when no cost of the target or more is of interest, each for itself."""


def bounds_of(problem: GaitProblem) -> Bounds:
    """The narrowest bounds there are: of NAO's phases in coordinates of their own, of others by their exact functions.

    Raises:
        InputError: an operation that cannot be enclosed.
        CompilerError: there is no compiler, or it fails.
    """
    return _power_bounds(problem) if has_power_form(problem) else BoxBounds(problem)


@lru_cache(maxsize=1)
def _power_bounds(problem: GaitProblem) -> PowerBounds:
    """Takes a second to build."""
    return PowerBounds(problem)
