"""Bounds of NAO's least power over boxes of z (see ``power_form.py``)."""

from __future__ import annotations

import numpy as np

from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.proofs.boxes import Assessed, in_threads
from nlp_gait.proofs.power_form import WIDENING, power_form, to_z


class PowerBounds:
    """Bounds from forms of degree two.

    Attributes:
        whole: (1, n, 2) box that holds the z of all x within their bounds.
    """

    def __init__(self, problem: GaitProblem) -> None:
        """Build the form, and check it against the exact functions.

        Raises:
            InputError: the problem has none, or both differ.
            CompilerError: there is no compiler, or it fails.
        """
        self._form = power_form(problem)
        self.whole = self._form.root[None]

    def place(self, x: Array) -> Array:
        """(P, n) z of points (P, n)."""
        return to_z(x)

    def assess(self, boxes: Array, target: float) -> Assessed:
        """What is left of boxes (P, n, 2) of z when no cost of the target or more is of interest; in threads."""
        return in_threads(lambda part: self._assess(part, target), boxes)

    def _assess(self, boxes: Array, target: float) -> Assessed:
        found = self._form.assess(boxes, target + WIDENING * abs(target))
        kept = found.left
        return Assessed(found.boxes[kept], found.lowest[kept], found.cut[kept].astype(np.intp), np.flatnonzero(kept))
