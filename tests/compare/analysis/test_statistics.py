"""Statistics against numbers worked out by hand, and against SciPy's where it has them."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compare.analysis.best_known import compute_gap
from compare.analysis.record_statistics import (
    ECDF_TARGETS,
    TARGETS,
    Curve,
    Weighting,
    approximate_rank_sum,
    bootstrap_interval,
    compute_a12,
    compute_band,
    compute_ecdf,
    compute_profiles,
    compute_rank_sum,
    compute_running_time,
    compute_signed_rank,
    correct_by_holm,
    find_best_known,
    make_curve,
)
from nlp_gait.formulation import Objective
from tests.compare.records import record

POWER = Objective(name="power", unit="W")
costs = st.lists(st.floats(0.0, 10.0) | st.just(math.inf), min_size=2, max_size=12)


def test_weighting_charges_derivatives_as_finite_differences() -> None:
    # n = 9: 10 for a first derivative, 10 * 11 / 2 = 55 for the second.
    calls = {"f": 3, "g": 2, "gradient": 4, "jacobian": 5, "hessian": 6}
    assert Weighting().equivalent(calls, 9) == 3 + 2 + 40 + 50 + 330
    assert Weighting(g=0.0, gradient=2.0, jacobian=3.0, hessian=0.5).equivalent(calls, 9) == 3 + 8 + 15 + 3


def test_expected_running_time() -> None:
    # Two successes after 30 and 50, a failure that cost 100: 180 / 2.
    assert compute_running_time([30.0, math.inf, 50.0], [100.0, 100.0, 100.0]) == 90.0
    assert compute_running_time([math.inf], [100.0]) == math.inf
    assert compute_running_time([7.0], [100.0]) == 7.0


def test_gap_is_relative_to_the_reference_and_positive_if_worse() -> None:
    assert compute_gap(11.0, 10.0, POWER) == pytest.approx(0.1)
    stability = Objective(name="margin", unit="m", sense="maximise")
    assert compute_gap(0.09, 0.1, stability) == pytest.approx(0.1)
    assert compute_gap(0.25, 0.0, POWER) == 0.25
    assert compute_gap(-9.0, -10.0, POWER) == pytest.approx(0.1)
    assert compute_gap(math.nan, 10.0, POWER) == math.inf


def test_curve_of_a_search_and_of_a_gradient_method() -> None:
    found = make_curve(record("pso", 0, [(10, None), (20, 11.0), (30, 10.0)]), POWER, 10.0, Weighting())
    assert found.gap.tolist() == pytest.approx([math.inf, 0.1, 0.0])
    assert (found.cost_to_reach(0.1), found.cost_to_reach(0.05), found.cost_to_reach(-1.0)) == (20.0, 30.0, math.inf)
    assert found.cost_to_reach(0.05, "seconds") == pytest.approx(0.3)
    # 2 variables: 4 + 3 * 3 + 2 * 6 = 25, all spent by the end.
    calls = {"f": 4, "gradient": 3, "hessian": 2}
    ended = make_curve(record("ipopt", 0, [(4, 10.0)], evaluations=calls), POWER, 10.0, Weighting())
    assert ended.evaluations.tolist() == [25.0] and ended.cost_to_reach(0.0) == 25.0


def test_an_infeasible_run_reaches_no_target() -> None:
    refused = make_curve(record("pso", 0, [(10, 9.0)], feasible=False), POWER, 10.0, Weighting())
    assert refused.cost_to_reach(1.0) == math.inf


def test_ecdf_counts_unsolved_pairs() -> None:
    at, share = compute_ecdf(np.array([5.0, 2.0, np.inf, 5.0]))
    assert at.tolist() == [2.0, 5.0] and share.tolist() == [0.25, 0.75]
    assert compute_ecdf(np.array([np.inf]))[0].size == 0


def test_performance_profile() -> None:
    profile = compute_profiles({"a": [10.0, 40.0, math.inf], "b": [20.0, 10.0, math.inf]})
    assert [v.tolist() for v in profile["a"]] == [[1.0, 4.0], pytest.approx([1 / 3, 2 / 3])]
    assert [v.tolist() for v in profile["b"]] == [[1.0, 2.0], pytest.approx([1 / 3, 2 / 3])]


def test_band_keeps_the_last_gap_of_a_run_that_has_ended() -> None:
    costs = [np.array([1.0, 3.0]), np.array([2.0])]
    gaps = [np.array([0.5, 0.1]), np.array([0.2])]
    low, middle, high = compute_band(costs, gaps, np.array([0.5, 1.0, 2.0, 3.0]))
    assert low.tolist() == [np.inf, 0.5, 0.2, 0.1]
    assert middle.tolist() == [np.inf, 0.5, 0.2, 0.1]
    assert high.tolist() == [np.inf, np.inf, 0.5, 0.2]


def test_rank_sum_of_the_samples_that_the_paper_prints() -> None:
    """Eleven runs each with W = 70 (U = 4) give z = -3.677 with continuity correction (Gupta et al. 2023, section 5.3)."""
    first = [*range(1, 11), 14.5]  # ranks 1 to 10 and 15 among 22: W = 70
    second = [11, 12, 13, 14, *range(16, 23)]
    from scipy.stats import norm

    assert compute_rank_sum(first, second) == pytest.approx(2 * norm.sf(3.677), rel=2e-3)


def test_rank_sum_by_counting() -> None:
    # Complete separation of 3 and 3: 2 of the 20 arrangements are as extreme.
    assert compute_rank_sum([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]) == pytest.approx(0.1)
    assert compute_rank_sum([1.0, 1.0], [1.0, 1.0]) == 1.0
    assert compute_rank_sum([math.inf] * 3, [math.inf] * 3) == 1.0


def test_signed_rank_by_counting() -> None:
    # All five differences have one sign: 2 of the 32 sign patterns are as extreme.
    a, b = [1.0, 2.0, 3.0, 4.0, 5.0], [2.0, 4.0, 6.0, 8.0, 10.0]
    assert compute_signed_rank(a, b) == pytest.approx(2 / 32)
    assert compute_signed_rank(a, a) == 1.0
    # An infeasible run is further away than anything; two infeasible ones are equal.
    assert compute_signed_rank([*a, math.inf], [*b, math.inf]) == pytest.approx(2 / 32)
    assert compute_signed_rank([*a, 0.0], [*b, math.inf]) == pytest.approx(2 / 64)


def test_holm_by_hand() -> None:
    assert correct_by_holm([0.01, 0.04, 0.03]).tolist() == pytest.approx([0.03, 0.06, 0.06])
    assert correct_by_holm([0.5, 0.6]).tolist() == pytest.approx([1.0, 1.0])
    assert correct_by_holm([]).tolist() == []


@settings(derandomize=True, deadline=None)
@given(p=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=10))
def test_holm_lies_between_none_and_bonferroni_and_keeps_the_order(p: list[float]) -> None:
    adjusted = correct_by_holm(p)
    assert (adjusted >= np.array(p)).all() and (adjusted <= np.minimum(len(p) * np.array(p), 1.0) + 1e-15).all()
    assert (np.diff(adjusted[np.argsort(p, kind="stable")]) >= 0.0).all()


def test_a12_by_hand() -> None:
    assert compute_a12([1.0, 2.0], [3.0, 4.0]) == 1.0
    assert compute_a12([1.0, 3.0], [2.0, 3.0]) == (1 + 1 + 0 + 0.5) / 4
    assert compute_a12([math.inf], [math.inf]) == 0.5


@pytest.mark.slow
@settings(derandomize=True, deadline=None, max_examples=40)
@given(a=costs, b=costs)
def test_effect_size_and_tests_are_symmetric(a: list[float], b: list[float]) -> None:
    assert compute_a12(a, b) == pytest.approx(1.0 - compute_a12(b, a))
    assert compute_rank_sum(a, b) == pytest.approx(compute_rank_sum(b, a))
    assert 0.0 <= compute_rank_sum(a, b) <= 1.0
    size = min(len(a), len(b))
    assert compute_signed_rank(a[:size], b[:size]) == pytest.approx(compute_signed_rank(b[:size], a[:size]))


def test_bootstrap_interval() -> None:
    sample = np.random.default_rng(1).normal(5.0, 1.0, 100)
    low, high = bootstrap_interval([sample], lambda x: float(np.mean(x)))
    # Normal theory: 1.96 standard errors of 0.1 on either side.
    assert low == pytest.approx(sample.mean() - 1.96 * sample.std() / 10, abs=0.03)
    assert high == pytest.approx(sample.mean() + 1.96 * sample.std() / 10, abs=0.03)
    assert bootstrap_interval([[3.0]], lambda x: float(x[0])) == (3.0, 3.0)
    low, high = bootstrap_interval([[1.0, math.inf]], lambda x: float(np.max(x)))
    assert (low, high) == (1.0, math.inf)


def test_targets_are_what_the_documentation_says() -> None:
    assert TARGETS == (1e-2, 1e-3, 1e-4, 1e-6)
    assert (len(ECDF_TARGETS), ECDF_TARGETS[0], ECDF_TARGETS[-1]) == (31, 1.0, pytest.approx(1e-6))
    assert np.diff(np.log10(ECDF_TARGETS)) == pytest.approx(np.full(30, -0.2))


def test_default_weights_are_one_evaluation_each() -> None:
    """A kind of call without a weight of its own is charged, not forgotten."""
    weights = Weighting(f=None, g=None).of_kind(2)  # type: ignore[arg-type]
    assert weights == {"f": 1.0, "g": 1.0, "gradient": 3.0, "jacobian": 3.0, "hessian": 6.0}


def test_best_known_is_the_best_that_the_judge_accepts() -> None:
    records = [
        record("pso", run, [(10, value)], feasible=run != 2) for run, value in enumerate((12.0, 11.0, 9.0, 13.0))
    ]
    assert find_best_known(records, POWER) == 11.0
    assert find_best_known(records, Objective(name="margin", unit="m", sense="maximise")) == 13.0
    assert math.isnan(find_best_known(records[2:3], POWER)) and math.isnan(find_best_known([], POWER))


def test_total_cost_of_a_run() -> None:
    found = make_curve(record("pso", 0, [(10, None), (20, 11.0), (30, 10.0)]), POWER, 10.0, Weighting())
    assert (found.total_cost(), found.total_cost("seconds")) == (30.0, pytest.approx(0.3))
    nothing = np.empty(0)
    failed = Curve(evaluations=nothing, seconds=nothing, gap=nothing)
    assert (failed.total_cost(), failed.total_cost("seconds"), failed.cost_to_reach(1.0)) == (0.0, 0.0, math.inf)
    assert found.evaluations.dtype == found.gap.dtype == found.seconds.dtype == float


def test_a_history_of_nothing_feasible_is_a_curve_without_a_gap() -> None:
    empty = make_curve(record("pso", 0, [(10, None), (20, None)]), POWER, 10.0, Weighting())
    assert np.isposinf(empty.gap).all()


def test_statistics_are_frozen_and_take_keywords_only() -> None:
    found = make_curve(record("pso", 0, [(10, 11.0)]), POWER, 10.0, Weighting())
    test = approximate_rank_sum([1.0], [2.0])
    for value, name in ((Weighting(), "f"), (found, "gap"), (test, "z")):
        with pytest.raises(FrozenInstanceError):
            setattr(value, name, 0.0)
        with pytest.raises(TypeError):
            type(value)(*(getattr(value, field.name) for field in fields(value)))
    assert found != make_curve(
        record("pso", 0, [(10, 11.0)]), POWER, 10.0, Weighting()
    )  # by identity: arrays have no truth
    assert not hasattr(test, "__dict__")


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="zip"):
        compute_running_time([1.0, 2.0], [1.0])
    with pytest.raises(ValueError, match="zip"):
        compute_band([np.array([1.0])], [np.array([1.0])] * 2, np.array([1.0]))


def test_the_share_of_no_pairs_is_empty() -> None:
    at, share = compute_ecdf(np.array([]))
    assert at.size == share.size == 0
    one, half = compute_ecdf(np.array([1.0])), compute_ecdf(np.array([1.0, np.inf]))
    assert (one[1].tolist(), half[1].tolist()) == ([1.0], [0.5])


def test_performance_profile_takes_whole_numbers_and_each_instance_has_its_own_cheapest() -> None:
    profile = compute_profiles({"a": [1, 100], "b": [2, 50]})
    assert [v.tolist() for v in profile["a"]] == [[1.0, 2.0], [0.5, 1.0]]
    assert [v.tolist() for v in profile["b"]] == [[1.0, 2.0], [0.5, 1.0]]


def test_band_of_four_and_five_runs_takes_the_lower_middle() -> None:
    for count, middle in ((4, 2.0), (5, 3.0), (6, 3.0)):
        gaps = [np.array([float(run)]) for run in range(1, count + 1)]
        assert compute_band([np.array([1.0])] * count, gaps, np.array([1.0]))[1].tolist() == [middle]


def test_a_run_without_a_feasible_point_is_worse_than_any_difference() -> None:
    """Its rank among the differences is the last, whatever the sign and the size of the costs."""
    for shift in (-50.0, 0.0, 50.0):
        a = [shift + value for value in (0.0, 1.0, 2.0, 3.0, 4.0)]
        b = [shift + value for value in (5.0, 3.0, 4.5, 6.25, 4.125)]
        # Ranks of the finite differences by size; the infeasible run of a outranks them all with the other sign: W = 6.
        assert compute_signed_rank([*a, math.inf], [*b, shift]) == pytest.approx(wilcoxon_p(6, 6))
        # A pair that differs by the whole spread still ranks below it.
        assert compute_signed_rank([shift, shift, math.inf], [shift + 9.0, shift + 1.0, shift]) == pytest.approx(
            wilcoxon_p(3, 3)
        )


def wilcoxon_p(rank_total: int, n: int) -> float:
    """Two-sided p-value of a rank total of the rarer sign, by counting all sign patterns of n ranks."""
    totals = [sum(rank for rank in range(1, n + 1) if pattern >> (rank - 1) & 1) for pattern in range(2**n)]
    tail = sum(total <= min(rank_total, n * (n + 1) // 2 - rank_total) for total in totals) / 2**n
    return min(1.0, 2.0 * tail)


def test_rank_sum_of_values_that_are_equal_but_for_one() -> None:
    assert compute_rank_sum([1.0, 1.0, 1.0], [1.0, 1.0, 2.0]) == pytest.approx(
        0.5, abs=0.02
    )  # of 6 places of the 2, 3 are in b
    assert compute_rank_sum([2.0, 1.0], [1.0, 1.0]) < 1.0


def test_rank_sum_is_two_sided() -> None:
    """Of 70 arrangements of 4 and 4, one at either end."""
    first, second = [1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]
    assert compute_rank_sum(first, second) == compute_rank_sum(second, first) == pytest.approx(2 / 70)


def test_holm_takes_whole_numbers_and_keeps_the_order_of_ties() -> None:
    assert correct_by_holm([1, 0]).tolist() == [1.0, 0.0] and correct_by_holm([1, 0]).dtype == float
    assert correct_by_holm([0.02] * 40).tolist() == pytest.approx([0.8] * 40)


def test_an_infeasible_run_is_worse_among_costs_that_hardly_differ() -> None:
    # Two differences of one sign: 2 of the 4 sign patterns are as extreme.
    assert compute_signed_rank([1.0, math.inf, 1.2], [1.0, 1.0, 1.1]) == pytest.approx(0.5)
    assert compute_signed_rank([1.1, 1.0, 1.0], [1.2, math.inf, 1.0]) == pytest.approx(0.5)
    # Beside the worst of the others it still differs by more than any two of them: ranks 2 and 1 against 3.
    assert compute_signed_rank([0.0, 0.0, math.inf], [9.0, 1.0, 9.0]) == pytest.approx(1.0)


def test_rank_sum_by_the_normal_approximation_of_equal_values() -> None:
    assert approximate_rank_sum([1.0, 1.0], [1.0]).p_less == 0.5


def test_bootstrap_interval_is_a_quantile_of_the_resamples() -> None:
    seen: list[float] = []

    def count(x: np.ndarray) -> float:
        assert x.dtype == float and len(x) == 3
        seen.append(float(len(seen)))
        return seen[-1]

    assert bootstrap_interval([[1, 2, 3]], count) == (50.0, 1950.0)  # 2.5 % and 97.5 % of 2000
    assert len(seen) == 2000
    seen.clear()
    assert bootstrap_interval([[1, 2, 3]], count, level=1.0) == (0.0, 1999.0)
    sample = list(range(30))
    assert bootstrap_interval([sample], np.mean) == bootstrap_interval([sample], np.mean)
