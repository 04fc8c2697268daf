"""Joint angles at the instants at which a robot or simulator is told them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from nlp_gait.errors import InputError
from nlp_gait.export.result import Result
from nlp_gait.export.sampled import sampled
from nlp_gait.problems.gait_problem import Array

PERIOD_MS = 40  # as in Gupta, Pratihar, Deb (2023), and Webots' worlds for NAO
INTERVALS = 1000  # of the grid that the splines run through: their error is below 1e-9 rad


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
        InputError: the problem has no joint angles, or the period is not a whole number of milliseconds >= 1.
    """
    if isinstance(period_ms, bool) or not isinstance(period_ms, int) or period_ms < 1:
        raise InputError(f"the period must be a whole number of milliseconds >= 1, got {period_ms!r}")
    own = sampled(result, np.finfo(float).max)
    if "q" not in own.arrays:
        raise InputError(f"problem {result.problem.name!r} has no joint angles to export")
    duration = float(own.arrays["t"][-1])
    signals = sampled(result, duration / INTERVALS)
    end_ms = max(1, round(1000.0 * duration))
    times_ms = (*range(0, end_ms, period_ms), end_ms)
    t, first = np.unique(signals.arrays["t"], return_index=True)
    angles = CubicSpline(t, signals.arrays["q"][first])(np.minimum(np.array(times_ms) / 1000.0, duration))
    return SetPoints(joints=signals.joints, times_ms=times_ms, angles=angles)
