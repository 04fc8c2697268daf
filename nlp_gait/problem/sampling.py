"""Time histories of a result, as dense as asked for."""

from __future__ import annotations

import math

from nlp_gait.errors import InputError
from nlp_gait.problem.result import Result
from nlp_gait.problem.signals import Signals

FINE_INTERVALS = 1000  # of a grid that splines run through: their error is below 1e-9 rad


def sampled(result: Result, period_s: float) -> Signals:
    """Signals on the problem's own grid, refined until neighbouring samples are at most a period apart.

    Raises:
        InputError: the problem has no signals, or the period is not positive.
    """
    if not period_s > 0.0:  # NaN fails too
        raise InputError(f"the time between samples must be > 0 s, got {period_s!r}")
    problem, x = result.problem, result.x
    signals = problem.signals(x)
    times = signals.arrays["t"]
    longest = float((times[1:] - times[:-1]).max())
    factor = math.ceil(longest / period_s - 1e-9)  # a step that is a period but for rounding is not halved
    dense = problem.dense(factor) if factor > 1 else None
    return signals if dense is None else dense.signals(x)


def finely_sampled(result: Result) -> Signals:
    """Signals with at least ``FINE_INTERVALS`` intervals, where the problem can be refined; raises as ``sampled``."""
    own = sampled(result, math.inf)
    return sampled(result, float(own.arrays["t"][-1]) / FINE_INTERVALS)
