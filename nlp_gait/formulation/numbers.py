"""Numbers that users pass, validated."""

import math
import sys
from numbers import Real
from typing import TypeGuard

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation.signals import Array


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite real number, NumPy's included; True and False are not."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer larger than every float
        return False


def to_floats(what: str, values: object) -> Array:
    """Return array-like values of any shape as doubles, copied only if necessary; they need not be finite.

    Raises InputError for complex or masked numbers, texts, dates, true or false, which NumPy would convert silently.
    """
    # Importing numpy.ma here would cost every process a tenth of its start.
    if "numpy.ma" in sys.modules and np.ma.is_masked(values):
        raise InputError(f"{what} must be numbers, got a masked array; fill or remove masked values")
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
        got = f"{type(values).__name__} of {array.dtype}"
        raise InputError(f"{what} must be numbers, got {got}: use real numbers, not texts, true or false")
    return array.astype(np.float64, copy=False)
