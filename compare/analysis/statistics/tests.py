"""Tests of two solvers against each other, and the size of the difference.

All take costs that are to be minimised, infinite where a run found nothing feasible.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nlp_gait.formulation import Array


def rank_sum(a: Sequence[float], b: Sequence[float]) -> float:
    """Two-sided p-value of Wilcoxon's rank-sum test (Mann and Whitney's U): neither sample tends to be smaller.

    Exact if one sample has 8 values or fewer and there are no ties, else normal with tie and continuity correction; 1 if
    all values are equal.

    Source:
        Mann, Whitney (1947), On a test of whether one of two random variables is stochastically larger than the other, as
        in ``scipy.stats.mannwhitneyu``.
    """
    from scipy.stats import mannwhitneyu

    pooled = np.concatenate([a, b])
    if (pooled == pooled[0]).all():
        return 1.0
    return float(mannwhitneyu(a, b, alternative="two-sided").pvalue)


def signed_rank(a: Sequence[float], b: Sequence[float]) -> float:
    """Two-sided p-value of Wilcoxon's signed-rank test on pairs: differences are symmetric about zero.

    A run without a feasible point differs from one with by more than any two runs with one; pairs that are equal, or both
    without, are dropped. 1 if no pair is left.

    Args:
        a: (R,) costs of one solver.
        b: (R,) costs of the other; equal runs share their seed and starting points.

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
    """P-values of a family of tests, adjusted so that rejecting below alpha keeps the family-wise error at alpha.

    Args:
        p: (T,) p-values.

    Returns:
        (T,) adjusted p-values, in the same order.

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
