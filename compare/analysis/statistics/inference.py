"""Tests of two solvers against each other, effect sizes and confidence intervals.

All take costs to be minimised, infinite where a run found nothing feasible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nlp_gait.formulation import Array

RESAMPLES = 2000
SEED = 0  # intervals are repeatable


def rank_sum(a: Sequence[float], b: Sequence[float]) -> float:
    """Two-sided p-value of Wilcoxon's rank-sum test (Mann and Whitney's U): neither sample tends to be smaller.

    Exact if one sample has 8 values or fewer and there are no ties, else normal with tie and continuity correction; 1 if
    all values are equal.

    Source:
        Mann, Whitney (1947), On a test of whether one of two random variables is stochastically larger than the other.
    """
    from scipy.stats import mannwhitneyu

    pooled = np.concatenate([a, b])
    if (pooled == pooled[0]).all():
        return 1.0
    return float(mannwhitneyu(a, b, alternative="two-sided").pvalue)


def signed_rank(a: Sequence[float], b: Sequence[float]) -> float:
    """Two-sided p-value of Wilcoxon's signed-rank test on pairs (R,) of runs with the same seed and starting points.

    A run without a feasible point differs from one with by more than any two runs with one; pairs that are equal, or both
    without, are dropped. 1 if no pair is left.

    Source:
        Wilcoxon (1945), Individual comparisons by ranking methods, as in ``scipy.stats.wilcoxon``.
    """
    from scipy.stats import wilcoxon

    pooled = np.concatenate([a, b])
    finite = pooled[np.isfinite(pooled)]
    beyond = 2.0 * (finite.max() - finite.min()) + 1.0 + finite.max() if finite.size else 0.0
    differences = np.where(np.isfinite(a), a, beyond) - np.where(np.isfinite(b), b, beyond)
    differences = differences[differences != 0.0]
    return float(wilcoxon(differences).pvalue) if differences.size else 1.0


def holm(p: Sequence[float]) -> Array:
    """P-values (T,) of a family of tests, adjusted so that rejecting below alpha keeps the family-wise error at alpha.

    Source:
        Holm (1979), A simple sequentially rejective multiple test procedure.
    """
    values = np.asarray(p, dtype=float)
    order = np.argsort(values, kind="stable")
    factors = len(values) - np.arange(len(values))
    adjusted = np.empty_like(values)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * values[order]), 1.0)
    return adjusted


def a12(a: Sequence[float], b: Sequence[float]) -> float:
    """Probability that a run of the first solver is better than one of the second, ties counting half.

    0.5 is no difference; 0.56, 0.64 and 0.71 are called small, medium and large.

    Source:
        Vargha, Delaney (2000), A critique and improvement of the CL common language effect size statistics.
    """
    first, second = np.asarray(a)[:, None], np.asarray(b)[None, :]
    return float(np.mean((first < second) + 0.5 * (first == second)))


@dataclass(frozen=True, slots=True, kw_only=True)
class RankSum:
    """Test of a first sample against a second one by the normal approximation, as papers print it."""

    rank_sum: float  #: of the first sample within both, W
    z: float  #: standardised rank sum, with continuity correction
    p_two_sided: float  #: against the alternative that either sample tends to be smaller
    p_less: float  #: against the alternative that the first sample tends to be smaller


def rank_sum_normal(a: Sequence[float], b: Sequence[float]) -> RankSum:
    """Return Wilcoxon's (1945) rank-sum test by the normal approximation; ties share their mean rank.

    Equal to MATLAB's ``ranksum(a, b, 'method', 'approximate')``.
    """
    from scipy.stats import mannwhitneyu, norm

    m, n = len(a), len(b)
    if len(set([*a, *b])) == 1:
        return RankSum(rank_sum=m * (m + n + 1) / 2, z=0.0, p_two_sided=1.0, p_less=0.5)
    two_sided, less = (mannwhitneyu(a, b, alternative=side, method="asymptotic") for side in ("two-sided", "less"))
    u = float(two_sided.statistic)
    z = math.copysign(float(norm.isf(two_sided.pvalue / 2)), u - m * n / 2)
    return RankSum(rank_sum=u + m * (m + 1) / 2, z=z, p_two_sided=float(two_sided.pvalue), p_less=float(less.pvalue))


def bootstrap_interval(
    columns: Sequence[Sequence[float]], statistic: Callable[..., float], level: float = 0.95
) -> tuple[float, float]:
    """Percentile bootstrap interval of a statistic of columns (R,) over runs, drawn with all their columns.

    Source:
        Efron, Tibshirani (1993), An introduction to the bootstrap, chapter 13.
    """
    data = [np.asarray(column, dtype=float) for column in columns]
    draws = np.random.default_rng(SEED).integers(len(data[0]), size=(RESAMPLES, len(data[0])))
    values = np.sort([statistic(*(column[rows] for column in data)) for rows in draws])
    return _quantile(values, (1.0 - level) / 2.0), _quantile(values, (1.0 + level) / 2.0)


def _quantile(ascending: Array, share: float) -> float:
    return float(ascending[min(int(np.floor(share * len(ascending))), len(ascending) - 1)])
