"""The closed loop: finite at every gain, honest about standing still, and one optimum for search and multiple shooting."""

from __future__ import annotations

import numpy as np
import pytest

import nlp_gait
from metaheuristics import AntColony, minimize
from nlp_gait.backends.exact import exact_model
from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array, GaitProblem

# Stiff gains follow the plan of case 2 within 0.05 rad.
FOLLOWED_RAD = 0.05
# The archive of ants and IPOPT end within this of each other (relative).
AGREEMENT = 1e-5


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("stairs-track")


def values(problem: GaitProblem, x: list[float]) -> tuple[float, float, dict[str, float]]:
    """Cost, violation and indexes."""
    model = exact_model(problem)
    cost, violation, *_, indexes = model.function(x, problem.p)
    return float(cost), float(violation), dict(zip(model.index_names, np.array(indexes).ravel(), strict=True))


def test_stiff_gains_follow_the_plan(problem: GaitProblem) -> None:
    _, violation, indexes = values(problem, [100.0, 100.0, 1.45])
    assert violation == 0.0
    assert indexes["largest_error_rad"] < FOLLOWED_RAD
    assert indexes["zmp_margin_min_m"] > 0.0


def test_doing_nothing_is_rejected_by_the_tolerance(problem: GaitProblem) -> None:
    _, violation, indexes = values(problem, [0.0, 0.0, 1.45])
    assert violation > 1.0
    assert indexes["largest_error_rad"] > 1.0


def test_finite_at_every_gain(problem: GaitProblem) -> None:
    gains = np.linspace(0.0, 100.0, 11)
    X = np.array([[kp, kd, torso] for kp in gains for kd in gains for torso in (1.2, 1.5)])
    f, violation = nlp_gait.compile_objective(problem)(X)
    assert np.isfinite(f).all()
    assert np.isfinite(violation).all()


def test_the_printed_explicit_scheme_diverges_and_says_when(problem: GaitProblem) -> None:
    printed = nlp_gait.load("stairs-track", scheme="explicit").with_values(gravity_compensation=0.0)
    survived = values(printed, [23.3027, 86.2633, 1.25847])[2]["quanta_before_divergence"]
    assert 1 <= survived < 20
    assert values(problem, [23.3027, 86.2633, 1.25847])[2]["quanta_before_divergence"] == 350


def test_multiple_shooting_meets_the_ants() -> None:
    """On the first 0.08 s, which solve in seconds."""
    short = nlp_gait.load("stairs-track", duration_s=0.08)
    solution = nlp_gait.solve(short, x0=[60.0, 60.0, 1.4])
    assert solution.success, solution.status
    found = minimize(nlp_gait.compile_objective(short), AntColony(), evaluations=2_000, seed=0)
    assert found.feasible
    assert found.objective == pytest.approx(solution.objective, rel=AGREEMENT)


def test_signals(problem: GaitProblem) -> None:
    arrays: dict[str, Array] = dict(problem.signals(np.array([100.0, 100.0, 1.45]), problem.p).arrays)
    assert arrays["t"][[0, -1]] == pytest.approx([0.01, 3.5])
    assert arrays["q"].shape == arrays["qd"].shape == arrays["tau"].shape == (350, 9)
    error = np.abs(arrays["q"] - arrays["q_desired"]).max()
    assert error == pytest.approx(values(problem, [100.0, 100.0, 1.45])[2]["largest_error_rad"])


def test_one_gain_for_each_link() -> None:
    each = nlp_gait.load("stairs-track", gains="per-link")
    assert len(each.names) == 19
    same = values(each, [80.0] * 9 + [60.0] * 9 + [1.45])
    scalar = values(nlp_gait.load("stairs-track"), [80.0, 60.0, 1.45])
    assert same[0] == pytest.approx(scalar[0], rel=1e-12)


@pytest.mark.parametrize("options", [{"gains": "both"}, {"scheme": "midpoint"}, {"duration_s": 0.0}])
def test_options_that_are_not_allowed(options: dict[str, str | float]) -> None:
    with pytest.raises(InputError, match="must be"):
        nlp_gait.load("stairs-track", **options)
