"""Scores of solvers over many problems at all budgets, against hand computations and SciPy's beta distribution."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from compare.analysis.anytime import compute_area, compute_budget, read_gap, sample_best, score_anytime
from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import Curve
from compare.report.document import Document
from compare.report.solver_sections import make_anytime_section
from compare.report.writing import write_document
from tests.compare.records import record


def make_curve(*points: tuple[float, float]) -> Curve:
    evaluations, gaps = np.array(points, dtype=float).T
    return Curve(evaluations=evaluations, seconds=evaluations, gap=gaps)


def test_two_solvers_have_the_posterior_of_a_coin() -> None:
    gaps = np.array([[0.0, 1.0]] * 7 + [[1.0, 0.0]] * 3)
    first = sample_best(gaps)[:, 0]
    exact = beta(1 + 7, 1 + 3)
    assert first.mean() == pytest.approx(exact.mean(), abs=0.01)
    assert np.quantile(first, (0.025, 0.975)) == pytest.approx(exact.ppf((0.025, 0.975)), abs=0.02)


def test_three_solvers_agree_with_importance_sampling() -> None:
    orders = np.array([(0, 1, 2)] * 4 + [(1, 0, 2)] * 2 + [(2, 0, 1)])
    weights = np.random.default_rng(1).gamma(1.0, 1.0, (100_000, 3))
    chosen = weights[:, orders]
    likelihood = (chosen[:, :, 0] / chosen.sum(axis=2) * chosen[:, :, 1] / chosen[:, :, 1:].sum(axis=2)).prod(axis=1)
    exact = (weights / weights.sum(axis=1, keepdims=True) * likelihood[:, None]).sum(axis=0) / likelihood.sum()
    assert sample_best(np.argsort(orders, axis=1).astype(float)).mean(axis=0) == pytest.approx(exact, abs=0.015)


def test_equivalent_and_infinite_gaps_share_their_rank() -> None:
    equal = sample_best(np.array([[0.0, 5e-4, math.inf, math.inf]] * 8)).mean(axis=0)
    assert equal[0] == pytest.approx(equal[1], abs=0.02) and equal[2] == pytest.approx(equal[3], abs=0.02)
    assert equal[0] > 5 * equal[2]


def test_the_area_is_that_under_the_steps_of_the_logarithm() -> None:
    curve = make_curve(
        (10, math.nan), (20, 1e-3), (60, 1e-9)
    )  # nothing, then half of six decades, then beyond the last
    assert compute_area(curve, 100.0) == pytest.approx((0.0 * 10 + 0.5 * 40 + 1.0 * 40) / 100)
    assert compute_area(make_curve((5, 2.0)), 100.0) == 0.0
    assert [read_gap(curve, cost) for cost in (9, 10, 20, 59, 60)] == [math.inf, math.inf, 1e-3, 1e-3, 1e-6]


def test_a_solver_that_is_never_worse_dominates() -> None:
    runs = [
        *(record("quick", run, [(10, 1.5), (100, 1.0)], problem=problem) for run in (0, 1) for problem in "ab"),
        *(record("slow", run, [(10, 1.8), (100, 1.2)], problem=problem) for run in (0, 1) for problem in "ab"),
        *(record("late", run, [(50, 1.9), (100, 1.0)], problem=problem) for run in (0, 1) for problem in "ab"),
    ]
    comparisons = compare_problems(runs)
    assert [compute_budget(c) for c in comparisons] == [100.0, 100.0]
    scores = {score.solver: score for score in score_anytime(comparisons)}
    assert {name: (s.dominates, s.dominated) for name, s in scores.items()} == {
        "quick": (4, 0),
        "slow": (0, 2),
        "late": (0, 2),
    }
    assert scores["slow"].gaps == pytest.approx((math.inf, 0.8, 0.2))
    assert scores["quick"].costs == (100.0,) * 4 and scores["slow"].costs == (math.inf,) * 4


def test_the_section_is_written_as_a_page(tmp_path: Path) -> None:
    runs = [
        record(name, run, [(10, 1.5), (100, 1.0 + k)], problem=problem)
        for k, name in enumerate(("x", "y", "z"))
        for run in (0, 1)
        for problem in ("a", "b")
    ]
    document = Document(title="suite", parts=(make_anytime_section(compare_problems(runs)),))
    text = next(path for path in write_document(tmp_path, document, "page") if path.suffix == ".md").read_text()
    assert "of 4, on which" in text and "critical-difference" in text
