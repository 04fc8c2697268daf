"""The rank-sum test with the statistics that the NAO paper prints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compare.analysis.record_statistics import approximate_rank_sum

SAMPLES = st.lists(st.integers(0, 6), min_size=1, max_size=14)


def samples_with_rank_sum(first: list[int]) -> tuple[list[int], list[int]]:
    """Eleven of the ranks 1 to 22, and the others."""
    return first, [rank for rank in range(1, 23) if rank not in first]


@pytest.mark.parametrize(
    ("first", "rank_sum", "z", "p_two_sided", "p_less"),
    [
        ([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15], 70, -3.6772, 2.3577e-4, 1.1789e-4),
        ([1, 2, 3, 4, 5, 6, 7, 10, 12, 18, 22], 90, -2.3639, 0.018082, 0.0090409),
    ],
)
def test_numbers_of_section_5_3(first: list[int], rank_sum: float, z: float, p_two_sided: float, p_less: float) -> None:
    test = approximate_rank_sum(*samples_with_rank_sum(first))
    assert test.rank_sum == rank_sum
    assert test.z == pytest.approx(z, abs=5e-5)  # the paper's four decimals
    assert test.p_two_sided == pytest.approx(p_two_sided, rel=1e-4)
    assert test.p_less == pytest.approx(p_less, rel=1e-4)


@pytest.mark.slow
@given(a=SAMPLES, b=SAMPLES)
def test_agrees_with_scipy_with_ties(a: list[int], b: list[int]) -> None:
    from scipy.stats import mannwhitneyu  # costs a second to import

    if len(set(a + b)) < 2:
        return
    test = approximate_rank_sum(a, b)
    for p, alternative in ((test.p_two_sided, "two-sided"), (test.p_less, "less")):
        assert p == pytest.approx(mannwhitneyu(a, b, method="asymptotic", alternative=alternative).pvalue, rel=1e-9)


def test_the_other_way_round_is_the_mirror_image() -> None:
    a, b = np.arange(5.0), np.arange(3.0, 11.0)
    there, back = approximate_rank_sum(a, b), approximate_rank_sum(b, a)
    assert there.z == -back.z and there.p_two_sided == back.p_two_sided
    assert there.p_less < 0.5 < back.p_less


def test_all_values_equal() -> None:
    test = approximate_rank_sum([1.0, 1.0], [1.0])
    assert (test.z, test.p_two_sided) == (0.0, 1.0)


def test_infinite_values_rank_last() -> None:
    assert approximate_rank_sum([1.0, 2.0], [3.0, float("inf")]).rank_sum == 3.0
