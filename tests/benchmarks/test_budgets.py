"""Who is best at which budget: prices and leaders of made-up curves, by hand, and what a run is."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.budgets.opponents import OPPONENTS, TARGETS, tasks_of
from benchmarks.budgets.page import leaders, price, write_page
from compare.analysis.record_statistics import Curve
from compare.study.task import ProblemSpec, check_task


def curve(*points: tuple[float, float]) -> Curve:
    """Best so far from (evaluations, gap)."""
    evaluations, gap = np.array(points, dtype=float).T
    return Curve(evaluations=evaluations, seconds=evaluations, gap=gap)


FOUND = {
    "cma": [curve((50, math.inf), (200, 5e-3), (900, 5e-5)), curve((100, 1.0), (400, 5e-3), (2000, 5e-3))],
    "lshade 1e3": [curve((100, 0.5), (1000, 1e-6))],
    "lshade 1e4": [curve((100, 0.01), (1000, 1e-7))],
}


def test_the_price_counts_failures_too() -> None:
    """One of two runs arrives after 900 evaluations, the other has spent 2,000 in vain: 2,900 for one success."""
    assert price(FOUND["cma"], 1e-2) == (300.0, 2)
    assert price(FOUND["cma"], 1e-4) == (2900.0, 1)
    assert price(FOUND["cma"], 1e-6) == (math.inf, 0)


def test_who_knows_its_budget_takes_part_at_that_only() -> None:
    assert [label for label, _ in leaders(FOUND, 1000)] == ["lshade 1e3", "cma"]
    assert [label for label, _ in leaders(FOUND, 100)] == []  # half of cma's runs have nothing feasible yet
    assert leaders(FOUND, 300) == [("cma", (5e-3 + 1.0) / 2)]


@pytest.mark.slow
def test_the_page_has_both_tables_and_a_figure(tmp_path: Path) -> None:
    written = write_page(tmp_path, {"nao-ssp": FOUND}, 2)
    text = written[0].read_text()
    assert "| cma | 300 / 2,900 (1/2) / 2,900 (1/2) |" in text
    assert "| 1,000 | lshade 1e3 < 0.01 %, cma 0.25 % |" in text
    assert all(path.stat().st_size > 1000 for path in written[1:])


def test_every_opponent_can_run_and_ends_at_the_tightest_target() -> None:
    for name, reference, target in (("nao-ssp", 0.8, 0.80008), ("walk12", 0.97, 0.969903)):
        for opponent in OPPONENTS:
            (task, *_) = tasks_of(ProblemSpec(name=name), opponent, 2, reference)
            check_task(task)
            assert math.isclose(task.stop.target, target) and task.stop.evaluations == opponent.evaluations
    assert TARGETS[-1] == 1e-4
