"""Statistics against numbers worked out by hand, and against SciPy's where it has them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compare.statistics.distribution import band, ecdf, performance_profile
from compare.statistics.intervals import bootstrap_interval
from compare.statistics.run_length import Weighting, curve, expected_running_time, relative_gap
from compare.statistics.tests import a12, holm, rank_sum, signed_rank
from nlp_gait.problems.gait_problem import Objective
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
    assert expected_running_time([30.0, math.inf, 50.0], [100.0, 100.0, 100.0]) == 90.0
    assert expected_running_time([math.inf], [100.0]) == math.inf
    assert expected_running_time([7.0], [100.0]) == 7.0


def test_gap_is_relative_to_the_reference_and_positive_if_worse() -> None:
    assert relative_gap(11.0, 10.0, POWER) == pytest.approx(0.1)
    stability = Objective(name="margin", unit="m", sense="maximise")
    assert relative_gap(0.09, 0.1, stability) == pytest.approx(0.1)
    assert relative_gap(0.25, 0.0, POWER) == 0.25
    assert relative_gap(-9.0, -10.0, POWER) == pytest.approx(0.1)
    assert relative_gap(math.nan, 10.0, POWER) == math.inf


def test_curve_of_a_search_and_of_a_gradient_method() -> None:
    found = curve(record("pso", 0, [(10, None), (20, 11.0), (30, 10.0)]), POWER, 10.0, Weighting())
    assert found.gap.tolist() == pytest.approx([math.inf, 0.1, 0.0])
    assert (found.reached(0.1), found.reached(0.05), found.reached(-1.0)) == (20.0, 30.0, math.inf)
    assert found.reached(0.05, "seconds") == pytest.approx(0.3)
    # 2 variables: 4 + 3 * 3 + 2 * 6 = 25, all spent by the end.
    calls = {"f": 4, "gradient": 3, "hessian": 2}
    ended = curve(record("ipopt", 0, [(4, 10.0)], evaluations=calls), POWER, 10.0, Weighting())
    assert ended.evaluations.tolist() == [25.0] and ended.reached(0.0) == 25.0


def test_what_the_judge_refuses_has_reached_nothing() -> None:
    refused = curve(record("pso", 0, [(10, 9.0)], feasible=False), POWER, 10.0, Weighting())
    assert refused.reached(1.0) == math.inf


def test_ecdf_counts_unsolved_pairs() -> None:
    at, share = ecdf(np.array([5.0, 2.0, np.inf, 5.0]))
    assert at.tolist() == [2.0, 5.0] and share.tolist() == [0.25, 0.75]
    assert ecdf(np.array([np.inf]))[0].size == 0


def test_performance_profile() -> None:
    profile = performance_profile({"a": [10.0, 40.0, math.inf], "b": [20.0, 10.0, math.inf]})
    assert [v.tolist() for v in profile["a"]] == [[1.0, 4.0], pytest.approx([1 / 3, 2 / 3])]
    assert [v.tolist() for v in profile["b"]] == [[1.0, 2.0], pytest.approx([1 / 3, 2 / 3])]


def test_band_keeps_the_last_gap_of_a_run_that_has_ended() -> None:
    costs = [np.array([1.0, 3.0]), np.array([2.0])]
    gaps = [np.array([0.5, 0.1]), np.array([0.2])]
    low, middle, high = band(costs, gaps, np.array([0.5, 1.0, 2.0, 3.0]))
    assert low.tolist() == [np.inf, 0.5, 0.2, 0.1]
    assert middle.tolist() == [np.inf, 0.5, 0.2, 0.1]
    assert high.tolist() == [np.inf, np.inf, 0.5, 0.2]


def test_rank_sum_of_the_samples_that_the_paper_prints() -> None:
    """Eleven runs each with W = 70 (U = 4) give z = -3.677 with continuity correction (Gupta et al. 2023, section 5.3)."""
    first = [*range(1, 11), 14.5]  # ranks 1 to 10 and 15 among 22: W = 70
    second = [11, 12, 13, 14, *range(16, 23)]
    from scipy.stats import norm

    assert rank_sum(first, second) == pytest.approx(2 * norm.sf(3.677), rel=2e-3)


def test_rank_sum_by_counting() -> None:
    # Complete separation of 3 and 3: 2 of the 20 arrangements are as extreme.
    assert rank_sum([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]) == pytest.approx(0.1)
    assert rank_sum([1.0, 1.0], [1.0, 1.0]) == 1.0
    assert rank_sum([math.inf] * 3, [math.inf] * 3) == 1.0


def test_signed_rank_by_counting() -> None:
    # All five differences have one sign: 2 of the 32 sign patterns are as extreme.
    a, b = [1.0, 2.0, 3.0, 4.0, 5.0], [2.0, 4.0, 6.0, 8.0, 10.0]
    assert signed_rank(a, b) == pytest.approx(2 / 32)
    assert signed_rank(a, a) == 1.0
    # An infeasible run is further away than anything; two infeasible ones are equal.
    assert signed_rank([*a, math.inf], [*b, math.inf]) == pytest.approx(2 / 32)
    assert signed_rank([*a, 0.0], [*b, math.inf]) == pytest.approx(2 / 64)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]).tolist() == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.6]).tolist() == pytest.approx([1.0, 1.0])
    assert holm([]).tolist() == []


@settings(derandomize=True, deadline=None)
@given(p=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=10))
def test_holm_lies_between_none_and_bonferroni_and_keeps_the_order(p: list[float]) -> None:
    adjusted = holm(p)
    assert (adjusted >= np.array(p)).all() and (adjusted <= np.minimum(len(p) * np.array(p), 1.0) + 1e-15).all()
    assert (np.diff(adjusted[np.argsort(p, kind="stable")]) >= 0.0).all()


def test_a12_by_hand() -> None:
    assert a12([1.0, 2.0], [3.0, 4.0]) == 1.0
    assert a12([1.0, 3.0], [2.0, 3.0]) == (1 + 1 + 0 + 0.5) / 4
    assert a12([math.inf], [math.inf]) == 0.5


@settings(derandomize=True, deadline=None)
@given(a=costs, b=costs)
def test_effect_size_and_tests_are_symmetric(a: list[float], b: list[float]) -> None:
    assert a12(a, b) == pytest.approx(1.0 - a12(b, a))
    assert rank_sum(a, b) == pytest.approx(rank_sum(b, a))
    assert 0.0 <= rank_sum(a, b) <= 1.0
    size = min(len(a), len(b))
    assert signed_rank(a[:size], b[:size]) == pytest.approx(signed_rank(b[:size], a[:size]))


def test_bootstrap_interval() -> None:
    sample = np.random.default_rng(1).normal(5.0, 1.0, 100)
    low, high = bootstrap_interval([sample], lambda x: float(np.mean(x)))
    # Normal theory: 1.96 standard errors of 0.1 on either side.
    assert low == pytest.approx(sample.mean() - 1.96 * sample.std() / 10, abs=0.03)
    assert high == pytest.approx(sample.mean() + 1.96 * sample.std() / 10, abs=0.03)
    assert bootstrap_interval([[3.0]], lambda x: float(x[0])) == (3.0, 3.0)
    low, high = bootstrap_interval([[1.0, math.inf]], lambda x: float(np.max(x)))
    assert (low, high) == (1.0, math.inf)
