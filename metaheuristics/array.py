"""The type of every array of numbers."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


def real_array(values: object) -> Array:
    """Return values as doubles, copied only if they are not that already.

    Raises:
        TypeError: They are complex, masked, texts or dates, of which NumPy would make doubles in silence.
        ValueError: They have no one shape.
    """
    array = np.asarray(values)
    if np.ma.is_masked(values) or array.dtype.kind not in "biufO":
        raise TypeError(f"they must be real numbers, got {type(values).__name__} of {array.dtype}")
    return array.astype(np.float64, copy=False)
