"""Time histories of a result, as dense as asked for."""

from __future__ import annotations

import math

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation.motion.signals import Array, Signals
from nlp_gait.formulation.result import Result

SHORTEST_S, LONGEST_S = 0.001, 60.0  # of a gait; a step takes a second
FINE_INTERVALS = 1000  # of a grid that splines run through: their error is below 1e-9 rad


def sample_signals(result: Result, period_s: float) -> Signals:
    """Signals on the problem's own grid, refined until neighbouring samples are at most a period apart.

    Raises:
        InputError: the problem has no signals, the period is not positive, or the gait lasts no time or too long to be sampled:
            an x may be far outside its bounds.
    """
    if not period_s > 0.0:  # NaN fails too
        raise InputError(f"the time between samples must be > 0 s, got {period_s!r}")
    problem, x = result.problem, result.x
    signals = problem.signals(x)
    times = signals.arrays["t"]
    _check_times(times)
    longest = float((times[1:] - times[:-1]).max())
    factor = math.ceil(longest / period_s - 1e-9)  # a step that is a period but for rounding is not halved
    dense = problem.dense(factor) if factor > 1 else None
    return signals if dense is None else dense.signals(x)


def _check_times(times: Array) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        lasts_s = float(times[-1] - times[0])
        forward = bool((times[1:] >= times[:-1]).all())  # NaN fails too
    if not (forward and SHORTEST_S <= lasts_s <= LONGEST_S):
        said = f"it lasts {lasts_s:g} s" if forward or lasts_s < 0.0 else "a phase of it runs backwards"
        raise InputError(
            f"time must run forward for {SHORTEST_S:g} to {LONGEST_S:g} s in a gait that is drawn, played or exported, but {said}"
        )


def sample_finely(result: Result) -> Signals:
    """Signals with at least ``FINE_INTERVALS`` intervals, where the problem can be refined; raises as ``sample_signals``."""
    own = sample_signals(result, math.inf)
    return sample_signals(result, float(own.arrays["t"][-1]) / FINE_INTERVALS)
