"""Joint angles at the instants at which a robot or simulator is told them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, sample_finely

PERIOD_MS = 40  # as in Gupta, Pratihar, Deb (2023), and Webots' worlds for NAO


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPoints:
    """Poses of all joints.

    Attributes:
        joints: names of the columns.
        times_ms: (T,) whole milliseconds, strictly increasing.
        angles: (T, J) [rad]; NaN leaves a joint alone.
    """

    joints: tuple[str, ...]
    times_ms: tuple[int, ...]
    angles: Array


def set_points(result: Result, period_ms: int = PERIOD_MS) -> SetPoints:
    """Planned joint angles at every period from time zero, and at the end rounded to the millisecond.

    Raises:
        InputError: the problem has no time histories, or the period is not a whole number of milliseconds >= 1.
    """
    if isinstance(period_ms, bool) or not isinstance(period_ms, int) or period_ms < 1:
        raise InputError(f"the period must be a whole number of milliseconds >= 1, got {period_ms!r}")
    signals = sample_finely(result)
    duration = float(signals.arrays["t"][-1])
    end_ms = max(1, round(1000.0 * duration))
    times_ms = (*range(0, end_ms, period_ms), end_ms)
    angles = CubicSpline(signals.arrays["t"], signals.arrays["q"])(np.minimum(np.array(times_ms) / 1000.0, duration))
    return SetPoints(joints=signals.joints, times_ms=times_ms, angles=angles)
