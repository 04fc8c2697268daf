"""What counts as a number where users give them."""

from __future__ import annotations

import math
import sys
from numbers import Real
from typing import TypeGuard

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation.motion.signals import Array


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a finite real number, NumPy's included; True and False are not."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number beyond every float
        return False


def to_floats(what: str, values: object) -> Array:
    """Values of any shape as doubles, copied only if they are not that already; they need not be finite.

    Args:
        what: what they are, for messages.
        values: an array, or what becomes one.

    Raises:
        InputError: complex numbers, masked ones, texts, dates, true or false: NumPy would make doubles of them in silence.
    """
    if "numpy.ma" in sys.modules and np.ma.is_masked(
        values
    ):  # imported here it would cost every process a tenth of its start
        raise InputError(f"{what} must be numbers, got a masked array; fill what is masked, or leave it out")
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O" and all(isinstance(v, Real) and not isinstance(v, bool) for v in array.flat):
            return array.astype(np.float64)
        if array.dtype.kind in "iuf" and not isinstance(values, np.ndarray):  # true among numbers would become 1
            if any(isinstance(v, (bool, np.bool_)) for v in np.asarray(values, dtype=object).flat):
                raise InputError(f"{what} must be numbers, got true or false among them")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{what} must be numbers, got {type(values).__name__}: {error}") from error
    if array.dtype.kind not in "iuf":
        raise InputError(
            f"{what} must be numbers, got {type(values).__name__} of {array.dtype}: give real ones, no texts, true or false"
        )
    return array.astype(np.float64, copy=False)
