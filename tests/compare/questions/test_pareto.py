"""Fronts: knees of made-up fronts by hand, the criteria against the judge, a small front of NAO, and searches."""

import numpy as np
import pytest

import nlp_gait
from compare.judge import evaluate
from compare.questions.pareto.front import MARGINS, FrontPoint, find_knees, make_competing_objective, solve_front
from compare.questions.pareto.pareto import Pareto, SearchFront, compute_qualities
from compare.questions.question import find
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import GaitProblem

X = np.array([0.31, -0.00122, 0.0035, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4.0])
# Slopes by multipliers and by differences of neighbouring optima agree to this part.
SLOPE_TOLERANCE = 0.02


def points(pairs: list[tuple[float, float]]) -> list[FrontPoint]:
    return [FrontPoint(value=v, power_W=w, price=0.0, violation=0.0, x=(0.0,)) for v, w in pairs]


def broken_line(*corners: tuple[float, float]) -> list[FrontPoint]:
    """Points along straight pieces between corners."""
    v, w = np.array(corners).T
    fine = np.unique(np.round(np.union1d(np.linspace(v[0], v[-1], 81), v), 9))
    return points(list(zip(fine.tolist(), np.interp(fine, v, w).tolist(), strict=True)))


def test_knees_are_corners_before_which_the_front_is_flatter() -> None:
    (knee,) = find_knees(broken_line((0.0, 1.0), (0.7, 1.1), (1.0, 4.0)))
    assert knee.value == pytest.approx(0.7)
    turn = np.degrees(np.arctan2(2.9 / 3, 0.3) - np.arctan2(0.1 / 3, 0.7))
    assert knee.turn_deg == pytest.approx(turn, abs=0.1)
    two = find_knees(broken_line((0.0, 0.0), (0.4, 0.02), (0.45, 0.4), (0.9, 0.5), (1.0, 1.0)))
    assert [knee.value for knee in two] == pytest.approx([0.4, 0.9])
    arc = np.linspace(0.0, np.pi / 2, 60)
    assert find_knees(points([(float(np.sin(a)), float(1 - np.cos(a))) for a in arc])) == ()


@pytest.mark.usefixtures("without_compiler")
@pytest.mark.parametrize("name", ["nao-ssp", "nao-dsp"])
def test_criteria_are_the_judges_numbers(name: str) -> None:
    problem = nlp_gait.load(name, intervals=4)
    x = X if name == "nao-ssp" else np.array([0.31, 0.00683, 0.00007, 0.00485, 0.06828, -0.05291, -0.0217, 2.0])
    judged = evaluate(problem, x)
    objective = nlp_gait.compile_objective(problem)
    for margin in MARGINS:
        criterion = make_competing_objective(margin, problem)
        assert criterion.evaluate(problem, x) == pytest.approx(judged.metrics[f"{margin}_m"], rel=1e-9)
        assert criterion.evaluate_many(objective, x[None])[0] == pytest.approx(judged.metrics[f"{margin}_m"], rel=1e-9)
    speed = make_competing_objective("speed", problem)
    way = 0.06 if name == "nao-ssp" else 0.04  # of the hip, Tables 3 and 5
    assert speed.evaluate(problem, x) == pytest.approx(way / x[-1])
    assert speed.demand(problem, 2 * way / x[-1]).upper[-1] == pytest.approx(x[-1] / 2)


def test_prices_are_the_fronts_slopes() -> None:
    problem = nlp_gait.load("nao-ssp", intervals=4)
    for name, at, step in (("dbm_y_mean", 0.02, 1e-4), ("speed", 0.03, 1e-4)):
        criterion = make_competing_objective(name, problem)
        free = criterion.drop_demand(problem)
        limited = [criterion.demand(free, at + k * step) for k in (-1, 0, 1)]
        below, here, above = (nlp_gait.solve(p, starts=1, x0=np.clip(X, p.lower, p.upper)) for p in limited)
        assert below.objective < here.objective < above.objective
        slope = (above.objective - below.objective) / (2 * step)
        assert criterion.compute_price(here) == pytest.approx(slope, rel=SLOPE_TOLERANCE)


def test_what_cannot_be_traded_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="objective next to power"):
        make_competing_objective("dbm_z", nlp_gait.load("nao-ssp"))
    with pytest.raises(InputError, match="no power, balance and speed to trade"):
        make_competing_objective("speed", nlp_gait.load("walk12"))
    with pytest.raises(InputError, match="at least 5"):
        problem = nlp_gait.load("nao-ssp")
        solve_front(problem, make_competing_objective("speed", problem), points=2)


def test_quality_of_the_front_itself_is_perfect_and_an_empty_run_counts_as_nothing() -> None:
    front = broken_line((0.0, 1.0), (0.7, 1.1), (1.0, 4.0))
    runs = [SearchFront(solver="NSGA2", budget=10, points=points) for points in (tuple(front), ())]
    (row,) = compute_qualities(front, runs)
    assert row.hypervolume == pytest.approx((0.0, 0.5, 1.0))
    assert row.empty == 1
    assert row.igd == pytest.approx((0.0, 0.0, 0.0))
    assert row.gap == pytest.approx((0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def small() -> GaitProblem:
    """Three free variables, so that a search of some hundred evaluations comes near the front."""
    problem = nlp_gait.load("nao-ssp", intervals=4)
    fixed = dict(zip(problem.names, X, strict=True))
    free = ("hip_vy_start_m_s", "hip_vy_end_m_s", "single_support_time_s")
    problem = problem.fix(**{name: value for name, value in fixed.items() if name not in free})
    return problem.with_values(**{"single_support_time_s.lower": 3.0})


def test_a_small_front_is_below_what_searches_find(small: GaitProblem) -> None:
    found = find(Pareto(problem=small, points=5, starts=1, searches={"NSGA2": (100, 300)}, runs=1))
    values, powers = zip(*((p.value, p.power_W) for p in found.front), strict=True)
    assert list(values) == sorted(values) and list(powers) == sorted(powers)
    assert all(p.violation <= 1e-6 for p in found.front)
    assert found.least_gap is not None and found.least_gap > -0.05  # a chord of five points is above the front
    assert found.qualities[1].hypervolume[1] > 0.8
