"""Differences below the judge's tolerance are ties, and gaps from an optimum near zero are absolute."""

import math
import random
import re

import pytest

from compare.analysis.comparison import compare_problems
from compare.analysis.headline import write_headline
from compare.analysis.record_statistics import tie
from compare.analysis.units import compute_gap
from compare.study.record import RunRecord
from nlp_gait.formulation import Objective
from tests.compare.records import record

POWER = Objective(name="power", unit="W")
NOISE = [1e-16, 1e-13, 1e-11, 1e-9, 1e-8, 4e-7]  # below the tolerance of 1e-6


def study(values: dict[str, list[float]], problem: str = "walk") -> list[RunRecord]:
    return [
        record(solver, run, [(10, value)], problem=problem)
        for solver, costs in values.items()
        for run, value in enumerate(costs)
    ]


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("optimum", [1.0, -250.0, 3e-4, 1e12])
def test_noise_is_no_difference(noise: float, optimum: float) -> None:
    draw = random.Random(f"{noise} {optimum}")
    near = {name: [optimum + draw.random() * size * noise * abs(optimum) for _ in range(20)] for name, size in
            (("a", 0.1), ("b", 1.0), ("c", 0.5))}  # fmt: skip
    (comparison,) = compare_problems(study(near))
    assert len(comparison.pairs) == 3
    assert all(pair.rank_sum == 1.0 and pair.a12 == 0.5 for pair in comparison.pairs)


@pytest.mark.parametrize("optimum", [1.0, 1e-20, 0.0])
def test_differences_above_the_tolerance_are_differences(optimum: float) -> None:
    far = {"a": [optimum + 1e-9 * k for k in range(20)], "b": [optimum + 3e-6 + 1e-9 * k for k in range(20)]}
    (pair,) = compare_problems(study(far))[0].pairs
    assert pair.rank_sum < 1e-6 and pair.a12 == 1.0


@pytest.mark.parametrize("best", [0.0, 1e-300, 1e-26, -1e-17, 9e-9])
def test_near_zero_gaps_are_absolute(best: float) -> None:
    draw = random.Random(repr(best))
    runs = {"a": [best, best + 1e-12], "b": [best + draw.random() * 1e-9] * 2, "c": [best + 0.025] * 2}
    (comparison,) = compare_problems(study(runs))
    headline = write_headline(comparison)
    assert "; both a runs and both b runs reach it." in headline
    assert headline.startswith("c's median run ends 0.025 W above the best value found (")
    assert not re.search(r"\d{7}", headline)
    assert compute_gap(best + 0.5, best, POWER) == pytest.approx(0.5)


@pytest.mark.parametrize("gap", [3.6e-12, 9.9e-9, -4e-7, 1.9e-8, 1.1e-6, 3e-4])
def test_gaps_are_shown_down_to_what_counts_as_reached(gap: float) -> None:
    (comparison,) = compare_problems(study({"a": [0.9, 0.9], "b": [0.9 * (1 + gap)] * 2}))
    shown = comparison.format_gap(comparison.gap(comparison.reference * (1 + gap)))
    assert shown == {-4e-07: "0 %", 1.1e-6: "0.00011 %", 3e-4: "0.030 %"}.get(gap, "< 0.0001 %")
    assert ("b's median run ends" in write_headline(comparison)) == (gap > 1e-6)


def test_ties_keep_the_order_of_all_other_values() -> None:
    draw = random.Random(5)
    for _ in range(200):
        scale = 10.0 ** draw.uniform(-6, 6)
        costs = [scale * (1 + draw.choice([0, 1e-9, 1e-7, 1e-5, 1.0]) * draw.random()) for _ in range(12)] + [math.inf]
        tied = tie([costs[:6], costs[6:]], scale)
        flat = [*tied[0], *tied[1]]
        for a, b, c, d in zip(costs, flat, costs[1:], flat[1:], strict=False):
            assert (a < c) <= (b <= d) and (b == a or 0.0 < a - b <= 1e-6 * scale)
            assert a == c or abs(a - c) <= 1e-6 * scale or b != d
    assert flat[-1] == math.inf and tie([[math.inf], [math.inf]], math.nan) == [[math.inf], [math.inf]]
