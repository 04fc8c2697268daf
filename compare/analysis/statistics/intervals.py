"""Bootstrap confidence intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nlp_gait.formulation import Array

RESAMPLES = 2000
SEED = 0  # intervals are repeatable


def bootstrap_interval(
    columns: Sequence[Sequence[float]], statistic: Callable[..., float], level: float = 0.95
) -> tuple[float, float]:
    """Percentile bootstrap interval of a statistic over runs.

    Args:
        columns: of equal length (R,); runs are drawn with replacement, with all their columns.
        statistic: of the columns; it may be infinite.
        level: of confidence.

    Returns:
        Lower and upper end; an end is infinite where resamples are.

    Source:
        Efron, Tibshirani (1993), An introduction to the bootstrap, chapter 13.
    """
    data = [np.asarray(column, dtype=float) for column in columns]
    draws = np.random.default_rng(SEED).integers(len(data[0]), size=(RESAMPLES, len(data[0])))
    values = np.sort([statistic(*(column[rows] for column in data)) for rows in draws])
    return _quantile(values, (1.0 - level) / 2.0), _quantile(values, (1.0 + level) / 2.0)


def _quantile(ascending: Array, share: float) -> float:
    """A value of the sample: interpolation would meet infinities."""
    return float(ascending[min(int(np.floor(share * len(ascending))), len(ascending) - 1)])
