"""Scores of solvers over many problems at all budgets, against hand computations."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from compare.analysis.anytime import compute_budget, compute_gaps, rank_at_budgets, read_gap
from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import Curve
from compare.analysis.tuning import compute_area
from compare.report.document import Document
from compare.report.solver_sections import make_anytime_section
from compare.report.writing import write_document
from tests.compare.records import record


def make_curve(*points: tuple[float, float]) -> Curve:
    evaluations, gaps = np.array(points, dtype=float).T
    return Curve(evaluations=evaluations, seconds=evaluations, gap=gaps)


def test_the_area_is_that_under_the_steps_of_the_logarithm() -> None:
    curve = make_curve(
        (10, math.nan), (20, 1e-3), (60, 1e-9)
    )  # nothing, then half of six decades, then beyond the last
    assert compute_area(curve, 100.0) == pytest.approx((0.0 * 10 + 0.5 * 40 + 1.0 * 40) / 100)
    assert compute_area(make_curve((5, 2.0)), 100.0) == 0.0
    assert [read_gap(curve, cost) for cost in (9, 10, 20, 59, 60)] == [math.inf, math.inf, 1e-3, 1e-3, 1e-6]


def test_gaps_are_those_after_a_share_of_the_budget() -> None:
    runs = [
        *(record("quick", run, [(10, 1.5), (100, 1.0)], problem=problem) for run in (0, 1) for problem in "ab"),
        *(record("slow", run, [(10, 1.8), (100, 1.2)], problem=problem) for run in (0, 1) for problem in "ab"),
        *(record("late", run, [(50, 1.9), (100, 1.0)], problem=problem) for run in (0, 1) for problem in "ab"),
    ]
    comparisons = compare_problems(runs)
    assert [compute_budget(c) for c in comparisons] == [100.0, 100.0]
    gaps = compute_gaps(comparisons)
    assert gaps["slow"] == pytest.approx(np.array([[math.inf, 0.8, 0.2]] * 2))
    ranks = {name: rank.tolist() for name, rank in rank_at_budgets(comparisons).items()}
    assert ranks == {"quick": [2.0, 1.0, 1.5], "slow": [2.0, 2.0, 3.0], "late": [2.0, 3.0, 1.5]}


def test_the_section_is_written_as_a_page(tmp_path: Path) -> None:
    runs = [
        record(name, run, [(10, 1.5), (100, 1.0 + k)], problem=problem)
        for k, name in enumerate(("x", "y", "z"))
        for run in (0, 1)
        for problem in ("a", "b")
    ]
    document = Document(title="suite", parts=(make_anytime_section(compare_problems(runs)),))
    text = next(path for path in write_document(tmp_path, document, "page") if path.suffix == ".md").read_text()
    assert "after 10 %" in text and "critical-difference" in text
