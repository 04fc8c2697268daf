"""Statistics against numbers worked out by hand and SciPy's, and numbers as tables show them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compare.analysis.record_statistics import (
    Curve,
    approximate_rank_sum,
    compute_a12,
    compute_band,
    compute_ecdf,
    compute_rank_sum,
    compute_running_time,
    correct_by_holm,
    count_equivalent,
    describe_power,
    find_best_known,
    make_curve,
)
from compare.analysis.units import (
    BY_UNIT,
    choose_natural_step,
    compute_gap,
    format_millimetres,
    format_number,
    format_percent,
    with_unit,
)
from nlp_gait.formulation import Objective
from tests.compare.records import record

POWER = Objective(name="power", unit="W")
costs = st.lists(st.floats(0.0, 10.0) | st.just(math.inf), min_size=2, max_size=12)


def test_derivatives_are_counted_as_finite_differences() -> None:
    # n = 9: 10 for a first derivative, 10 * 11 / 2 = 55 for the second.
    calls = {"f": 3, "g": 2, "gradient": 4, "jacobian": 5, "hessian": 6}
    assert count_equivalent(calls, 9) == 3 + 2 + 40 + 50 + 330


def test_expected_running_time() -> None:
    # Two successes after 30 and 50, a failure that cost 100: 180 / 2.
    assert compute_running_time([30.0, math.inf, 50.0], [100.0, 100.0, 100.0]) == 90.0
    assert compute_running_time([math.inf], [100.0]) == math.inf
    assert compute_running_time([7.0], [100.0]) == 7.0


MARGIN = Objective(name="margin", unit="m", sense="maximise")


@pytest.mark.parametrize(
    ("value", "reference", "objective", "gap"),
    [
        (11.0, 10.0, POWER, 0.1),
        (0.09, 0.1, MARGIN, 0.1),
        (0.25, 0.0, POWER, 0.25),
        (-9.0, -10.0, POWER, 0.1),
        (math.nan, 10.0, POWER, math.inf),
    ],
)
def test_gap_is_relative_to_the_reference(value: float, reference: float, objective: Objective, gap: float) -> None:
    assert compute_gap(value, reference, objective) == pytest.approx(gap)


def test_curve_of_a_search_and_of_a_gradient_method() -> None:
    found = make_curve(record("pso", 0, [(10, None), (20, 11.0), (30, 10.0)]), POWER, 10.0)
    assert found.gap.tolist() == pytest.approx([math.inf, 0.1, 0.0])
    assert (found.cost_to_reach(0.1), found.cost_to_reach(0.05), found.cost_to_reach(-1.0)) == (20.0, 30.0, math.inf)
    assert found.cost_to_reach(0.05, "seconds") == found.total_cost("seconds") == pytest.approx(0.3)
    assert found.total_cost() == 30.0 and found.evaluations.dtype == found.gap.dtype == found.seconds.dtype == float
    # 2 variables: 4 + 3 * 3 + 2 * 6 = 25, all spent by the end.
    calls = {"f": 4, "gradient": 3, "hessian": 2}
    ended = make_curve(record("ipopt", 0, [(4, 10.0)], evaluations=calls), POWER, 10.0)
    assert ended.evaluations.tolist() == [25.0] and ended.cost_to_reach(0.0) == 25.0
    refused = make_curve(record("pso", 0, [(10, 9.0)], feasible=False), POWER, 10.0)
    assert refused.cost_to_reach(1.0) == math.inf
    assert np.isposinf(make_curve(record("pso", 0, [(10, None), (20, None)]), POWER, 10.0).gap).all()
    failed = Curve(evaluations=np.empty(0), seconds=np.empty(0), gap=np.empty(0))
    assert (failed.total_cost(), failed.total_cost("seconds"), failed.cost_to_reach(1.0)) == (0.0, 0.0, math.inf)


@pytest.mark.parametrize(
    ("costs", "at", "share"),
    [([5.0, 2.0, math.inf, 5.0], [2.0, 5.0], [0.25, 0.75]), ([math.inf], [], []), ([], [], []), ([1.0], [1.0], [1.0])],
)
def test_ecdf_counts_unsolved_pairs(costs: list[float], at: list[float], share: list[float]) -> None:
    assert [part.tolist() for part in compute_ecdf(np.array(costs))] == [at, share]


def test_band_keeps_the_last_gap_of_a_run_that_has_ended_and_takes_the_lower_middle() -> None:
    costs, gaps = [np.array([1.0, 3.0]), np.array([2.0])], [np.array([0.5, 0.1]), np.array([0.2])]
    low, middle, high = compute_band(costs, gaps, np.array([0.5, 1.0, 2.0, 3.0]))
    assert low.tolist() == middle.tolist() == [np.inf, 0.5, 0.2, 0.1]
    assert high.tolist() == [np.inf, np.inf, 0.5, 0.2]
    for count, expected in ((4, 2.0), (5, 3.0), (6, 3.0)):
        gaps = [np.array([float(run)]) for run in range(1, count + 1)]
        assert compute_band([np.array([1.0])] * count, gaps, np.array([1.0]))[1].tolist() == [expected]


INF = math.inf


@pytest.mark.parametrize(
    ("test", "a", "b", "p"),
    [
        # Complete separation of 3 and 3: 2 of the 20 arrangements are as extreme; of 4 and 4, 2 of 70.
        (compute_rank_sum, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 0.1),
        (compute_rank_sum, [1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], 2 / 70),
        (compute_rank_sum, [1.0, 1.0], [1.0, 1.0], 1.0),
        (compute_rank_sum, [INF] * 3, [INF] * 3, 1.0),
        (compute_a12, [1.0, 2.0], [3.0, 4.0], 1.0),
        (compute_a12, [1.0, 3.0], [2.0, 3.0], (1 + 1 + 0 + 0.5) / 4),
        (compute_a12, [INF], [INF], 0.5),
    ],
)
def test_tests_and_effect_size_by_counting(test: Any, a: list[float], b: list[float], p: float) -> None:
    assert test(a, b) == pytest.approx(p)
    assert test(b, a) == pytest.approx(1.0 - p if test is compute_a12 else p)


@pytest.mark.parametrize(
    ("first", "p"),
    [([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15], 2.3577e-4), ([1, 2, 3, 4, 5, 6, 7, 10, 12, 18, 22], 0.018082)],
)
def test_rank_sums_that_the_nao_paper_prints(first: list[int], p: float) -> None:
    """Eleven of the ranks 1 to 22 against the others, with continuity correction (Gupta et al. 2023, section 5.3)."""
    others = [rank for rank in range(1, 23) if rank not in first]
    assert approximate_rank_sum(first, others) == pytest.approx(p, rel=1e-4)
    assert compute_rank_sum(first, others) == pytest.approx(p, rel=2e-3)
    assert approximate_rank_sum([1.0, 1.0], [1.0]) == 1.0


@pytest.mark.parametrize(
    ("p", "adjusted"),
    [
        ([0.01, 0.04, 0.03], [0.03, 0.06, 0.06]),
        ([0.5, 0.6], [1.0, 1.0]),
        ([], []),
        ([1, 0], [1.0, 0.0]),  # whole numbers
        ([0.02] * 40, [0.8] * 40),
    ],
)
def test_holm_by_hand(p: list[float], adjusted: list[float]) -> None:
    assert correct_by_holm(p).tolist() == pytest.approx(adjusted) and correct_by_holm(p).dtype == float


def test_best_known_is_the_best_that_the_judge_accepts() -> None:
    values = (12.0, 11.0, 9.0, 13.0)
    margin = Objective(name="margin", unit="m", sense="maximise")
    powers, margins = (
        [record("pso", run, [(10, value)], feasible=run != 2, objective=objective) for run, value in enumerate(values)]
        for objective in (POWER, margin)
    )
    assert find_best_known(powers) == 11.0
    assert find_best_known(margins) == 13.0
    assert math.isnan(find_best_known(powers[2:3])) and math.isnan(find_best_known([]))


@given(costs, costs)
def test_the_rank_sum_test_is_that_of_scipy(a: list[float], b: list[float]) -> None:
    from scipy.stats import mannwhitneyu  # costs a second to import

    expected = 1.0 if len({*a, *b}) == 1 else float(mannwhitneyu(a, b, alternative="two-sided").pvalue)
    assert compute_rank_sum(a, b) == pytest.approx(expected, rel=1e-12)


def test_too_few_runs_for_any_difference_are_named() -> None:
    # Two samples of 3 have 20 orders: two of them are the most extreme, p = 0.1; of 4, 2 in 70.
    assert "least possible p-value is 0.1; 4 runs of each solver allow one" in describe_power([3, 3])
    assert describe_power([4, 4]) == describe_power([1, 1]) == ""
    # Five solvers of 5 runs: 10 pairs of p = 2 / 252.
    assert "10 pairs of solvers" in describe_power([5] * 5) and "least possible p-value is 0.079" in describe_power(
        [5] * 5
    )


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (-0.0, ".3f", "0.000"),
        (-4e-4, ".3f", "0.000"),
        (-6e-4, ".3f", "-0.001"),
        (-4e-6, "+.2%", "+0.00%"),
        (-0.0, "", "0.0"),
        (-0.4, ",.0f", "0"),
        (1234567.0, ",.0f", "1,234,567"),
        (7, "d", "7"),
        (math.nan, ".3f", "nan"),
    ],
)
def test_what_is_rounded_to_zero_has_no_sign(value: float, digits: str, shown: str) -> None:
    assert format_number(value, digits) == shown


def test_units_follow_numbers_whose_digits_mean_something() -> None:
    shown = {0.0: "0.000000 W", 1e-16: "1e-16 W", -2e-9: "-2e-09 W", 1e267: "1e+267 W", 0.8458681: "0.845868 W"}
    assert {value: with_unit(value, "W") for value in shown} == shown
    assert (with_unit(-1e-9, "W", ".3f"), with_unit(-1e-9, "1", "g")) == ("0.000 W", "-1e-09")
    assert format_millimetres(-1e-6) == "0.0 mm" and format_millimetres(None) == "-"
    assert format_percent(None) == format_percent(math.inf) == "-"


@pytest.mark.parametrize("unit", BY_UNIT)
def test_a_natural_step_is_what_its_words_say(unit: str) -> None:
    step = choose_natural_step(unit, 1.0)
    number, _, shown = step.words.partition(" ")
    scale = {"mm": 1e-3, "mm/s": 1e-3, "degree": math.pi / 180}.get(shown, 1.0)
    assert step.size == pytest.approx(float(number) * scale)
    assert shown in (unit, f"m{unit}", "degree") or not shown
