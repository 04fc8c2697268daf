"""Boxes of points: what pruning leaves of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nlp_gait.formulation import Array

Numbers = np.ndarray[Any, np.dtype[np.intp]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]


class Remaining(NamedTuple):
    """Boxes in which a feasible point below a target cost may lie."""

    boxes: Array  # (P, n, 2) without the slabs in which there is none
    lowest: Array  # (P,) lower bound of the cost of the feasible points in the box
    cut: Numbers  # (P,) variable to cut next
    origin: Numbers  # (P,) indices of the boxes that were pruned to these
