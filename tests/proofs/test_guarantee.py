"""What is proven between samples: true where a fine grid is, with the violation's bounds where it is not."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from casadi import MX

import nlp_gait
from compare.judge import evaluate
from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Over, Point, RowsOverTime
from nlp_gait.proofs import affine
from nlp_gait.proofs.guarantee import guarantee
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import row, toy
from tests.proofs.soundness import best_x, feasible_gaits, find_contradictions

SEED = 3
PEAK = 0.8  # of the toy's row, at half the time


def waving(limit: float, over: Over | None = "instant") -> GaitProblem:
    """A toy over two seconds whose row is x sin(pi s) <= limit, sampled where it is zero."""

    def at_phases(point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
        wave = point.x[0] * ca.sin(math.pi * phases)
        names = tuple(f"wave, {k}" for k in range(phases.shape[1]))
        value, labels = (ca.sum2(wave) / phases.shape[1], ()) if over == "mean" else (wave.T, names)
        if over == "interval":
            value, labels = (wave[1:] - wave[:-1]).T, names[1:]
        rows = Constraint(name="wave", labels=labels, unit="m", scale=1.0, value=value, upper=MX(limit), over=over)
        return Assembly(objective=MX(0), constraints=(rows,), metrics={"mean_m": ca.sum2(wave) / phases.shape[1]})

    rows = RowsOverTime(assemble=at_phases, times=lambda values: (1.0, 3.0), intervals=4, means=("mean_m",))
    base = toy(lambda x, y, lim, ops: (x, (row(0 * y, lower=MX(0.0)),)))
    return replace(base, rows_over_time=(rows,))


def test_a_row_that_fails_between_samples_is_found_with_when_and_by_how_much() -> None:
    found = guarantee(waving(0.5), np.array([PEAK, 0.0]))
    assert found.satisfied is False
    (violation,) = found.violations
    assert violation.row == "wave[wave]"
    assert violation.least <= PEAK - 0.5 <= violation.most <= 1.05 * (PEAK - 0.5)
    begins = 1.0 + 2.0 * math.asin(0.5 / PEAK) / math.pi
    assert violation.from_s <= begins <= violation.to_s <= begins + 0.01
    low, high = found.means["mean_m"]
    assert low <= 2 / math.pi * PEAK <= high <= 1.01 * low
    assert "wave[wave] is violated by 0.299 to 0.3 m" in str(found) and found.word == "no"


def test_a_row_that_touches_its_limit_holds() -> None:
    found = guarantee(waving(PEAK), np.array([PEAK, 0.0]))
    assert found.satisfied and not found.violations and str(found) == "all limits are satisfied at all times"


def test_up_to_a_kink_only_the_formula_before_it_counts() -> None:
    """At a jump of which nothing is known, the two terms of 5 and 4.8 would not cancel."""

    def at_phases(point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
        after = 0.5 <= phases  # noqa: SIM300  as splines ask
        value = 5 * after - 6 * point.x[0] * after
        labels = tuple(f"jump, {k}" for k in range(phases.shape[1]))
        rows = Constraint(name="jump", labels=labels, unit="m", scale=1.0, value=value.T, upper=MX(0.3), over="instant")
        return Assembly(objective=MX(0), constraints=(rows,), metrics={})

    rows = RowsOverTime(assemble=at_phases, times=lambda values: (0.0, 1.0), intervals=4, kinks=(0.5,))
    kinked = replace(waving(0.5), rows_over_time=(rows,))
    assert guarantee(kinked, np.array([PEAK, 0.0])).satisfied
    assert not guarantee(replace(kinked, rows_over_time=(replace(rows, kinks=()),)), np.array([PEAK, 0.0])).satisfied


def test_changes_over_an_interval_hold_for_every_beginning_of_it() -> None:
    largest = PEAK * math.sin(math.pi / 4)  # from zero to a quarter
    assert guarantee(waving(largest + 1e-5, "interval"), np.array([PEAK, 0.0])).satisfied
    found = guarantee(waving(largest - 1e-2, "interval"), np.array([PEAK, 0.0]))
    assert found.violations[0].least <= 1e-2 <= found.violations[0].most and found.violations[0].from_s == 1.0


def test_a_mean_is_that_over_time() -> None:
    mean = 2 / math.pi * PEAK
    assert guarantee(waving(mean + 1e-3, "mean"), np.array([PEAK, 0.0])).satisfied
    found = guarantee(waving(mean - 1e-3, "mean"), np.array([PEAK, 0.0]))
    (violation,) = found.violations
    assert found.satisfied is False and (violation.from_s, violation.to_s) == (1.0, 3.0)
    assert 0.0 < violation.least <= 1e-3 <= violation.most


def test_rows_that_say_nothing_of_time_are_named_as_sampled() -> None:
    found = guarantee(waving(0.5, None), np.array([PEAK, 0.0]))
    assert found.satisfied and found.sampled == ("wave",) and "checked on samples only: wave" in str(found)


@pytest.mark.parametrize("name", [pytest.param("nao-ssp", marks=pytest.mark.slow), "walk12"])
def test_best_known_gaits_hold_at_all_times_and_random_ones_are_not_contradicted(name: str) -> None:
    problem, x = nlp_gait.load(name), best_x(name)
    assert guarantee(problem, x).satisfied
    gaits = [x, *feasible_gaits(problem, x, 2, np.random.default_rng(SEED))]
    against, satisfied = find_contradictions(problem, gaits, 1001)
    assert not against and satisfied > 0


def test_a_stair_gait_that_breaks_a_limit_between_samples_breaks_it_by_what_the_grid_shows() -> None:
    problem, x = nlp_gait.load("stairs-plan"), best_x("stairs-plan")
    judged = evaluate(problem, x)
    proven = judged.guaranteed
    assert judged.feasible and proven is not None
    worst: dict[str, float] = {}
    for broken in judged.dense_violations:
        name = broken.name.rpartition(",")[0] + "]"
        worst[name] = max(worst.get(name, 0.0), broken.violation)
    most = {violation.row: violation.most for violation in proven.violations}
    for name, violation in worst.items():
        assert violation <= most[name] <= violation + 1e-3
    low, high = proven.means["energy_J"]
    assert low <= evaluate(problem, x).dense["energy_J"] * (1 + 1e-3) and high >= low > 0.0


def test_a_row_without_bounds_on_the_way_is_open_and_no_number_hides_it() -> None:
    def at_phases(point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
        pole = 1 / (phases - math.sqrt(0.5))
        names = tuple(f"pole, {k}" for k in range(phases.shape[1]))
        rows = Constraint(
            name="pole", labels=names, unit="m", scale=1.0, value=-(pole**2).T, upper=MX(0.0), over="instant"
        )
        wild = Constraint(name="wild", labels=names, unit="m", scale=1.0, value=pole.T, upper=MX(1e6), over="instant")
        mean = Constraint(name="mean", unit="m", scale=1.0, value=ca.sum2(pole), upper=MX(0.0), over="mean")
        return Assembly(objective=MX(0), constraints=(rows, wild, mean), metrics={"mean_m": ca.sum2(pole)})

    rows = RowsOverTime(assemble=at_phases, times=lambda values: (0.0, 1.0), means=("mean_m",))
    found = guarantee(replace(waving(PEAK), rows_over_time=(rows,)), np.array([PEAK, 0.0]))
    assert found.satisfied is not True
    assert {b.row: b.most for b in found.violations}["wild[pole]"] is None
    assert "mean_m" not in found.means and "any amount" in str(found)


def test_finite_differences_are_sampled_by_definition() -> None:
    found = guarantee(nlp_gait.load("nao-ssp", derivatives="finite-difference"), best_x("nao-ssp"))
    assert found.satisfied is None and "on samples only" in found.reason and found.word == "?"


def test_without_a_compiler_the_verdict_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise CompilerError("no C++ compiler")

    affine._library.cache_clear()
    monkeypatch.setattr(affine, "find_compiler", missing)
    found = guarantee(waving(0.5), np.array([PEAK, 0.0]))
    assert found.satisfied is None and "no C++ compiler" in str(found)


def test_an_infeasible_point_has_no_guarantee() -> None:
    problem = nlp_gait.load("walk12")
    assert evaluate(problem, [0.13, 0.13, 0.001, 0.001]).guaranteed is None
