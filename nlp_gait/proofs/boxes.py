"""Boxes of points: what pruning leaves of them, halves, and work on many boxes in threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.formulation import Array

Numbers = np.ndarray[Any, np.dtype[np.intp]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]


class Remaining(NamedTuple):
    """Boxes in which a feasible point below a target cost may lie.

    Attributes:
        boxes: (P, n, 2) without the slabs in which there is none.
        lowest: (P,) lower bound of the cost of the feasible points in the box.
        cut: (P,) variable to cut next.
        origin: (P,) indices of the boxes that were pruned to these.
    """

    boxes: Array
    lowest: Array
    cut: Numbers
    origin: Numbers


def prune_in_threads(prune: Callable[[Array], Remaining], boxes: Array) -> Remaining:
    """Prune parts of the boxes in threads; the result of a box does not depend on the others."""
    parts = np.array_split(np.arange(len(boxes)), max(1, min(available_cores(), len(boxes) // 64)))
    if len(parts) == 1:
        return prune(boxes)
    with ThreadPoolExecutor(len(parts)) as threads:
        found = list(threads.map(lambda part: prune(boxes[part]), parts))
    whole = [np.concatenate(columns) for columns in zip(*found, strict=True)]
    whole[3] = np.concatenate([part[f.origin] for part, f in zip(parts, found, strict=True)])
    return Remaining(*whole)


def halve(boxes: Array, cut: Numbers) -> Array:
    """Return (2 P, n, 2): each box cut in the middle of an edge, first all lower halves."""
    index = np.arange(len(boxes)), cut
    middle = 0.5 * boxes[(*index, 0)] + 0.5 * boxes[(*index, 1)]
    low, high = boxes.copy(), boxes.copy()
    low[(*index, 1)] = middle
    high[(*index, 0)] = middle
    return np.concatenate([low, high])
