"""Derivatives of optima: by hand, by solving again, and by CasADi's own."""

from dataclasses import replace

import numpy as np
import pytest
from casadi import MX

from nlp_gait import load
from nlp_gait.backends.optima.optimum import SHARP, Optimum, find_optimum
from nlp_gait.backends.optima.sensitivities import differentiate_by_models, differentiate_by_parameters
from nlp_gait.backends.solve import Continuation, find_cheapest_feasible
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem, Variable
from nlp_gait.formulation.solution import Outcome
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, row, toy

# IPOPT at its sharpest finds the optimal value to 1e-12, which over a step of 1e-6 is 1e-6 of a slope of one, and x* itself to
# 1e-9 of its range.
RESOLVED = 1e-5
RESOLVED_X = 1e-3
STEP = 1e-6


def found(problem: GaitProblem) -> Optimum:
    return solved(problem)[1]


def solved(problem: GaitProblem) -> tuple[Outcome, Optimum]:
    end = find_cheapest_feasible(Continuation(starts=3).run(problem))
    assert end is not None
    return end, find_optimum(problem, end)


def sharp(problem: GaitProblem, near: Outcome) -> Outcome:
    end = SHARP.run_from(problem, near)
    assert end is not None and end.converged
    return end


def slope(problem: GaitProblem, near: Outcome, name: str) -> tuple[float, np.ndarray]:
    """Of optimum and x*, by solving a little lower and higher."""
    ends = []
    for change in (-STEP, STEP):
        moved = problem.with_values(**{name: problem.value(name) + change})
        ends.append(sharp(moved, near))
    low, high = ends
    return problem.objective.sign * (high.cost - low.cost) / (2 * STEP), (high.x - low.x) / (2 * STEP)


@pytest.mark.parametrize(
    ("limit", "price", "moves"), [(1.5, 3.0, 1.0), (0.5, 0.0, 0.0)], ids=["binds", "does not bind"]
)
def test_a_corner_of_absolute_values_moves_with_its_limit(limit: float, price: float, moves: float) -> None:
    """3 (limit - 1) at (limit, limit), down to limit 1, where the kinks of |x - 1| and |y - 1| hold it, and up to x = 2."""
    at = found(toy(corner, limit=limit))
    answer = differentiate_by_parameters(at)
    assert at.objective == pytest.approx(price * (limit - 1.0), abs=1e-8)
    np.testing.assert_allclose(answer.objective, [price, 0.0, 0.0, 0.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(answer.x, np.outer([moves, moves], [1.0, 0.0, 0.0, 0.0, 0.0]), atol=1e-8)
    assert answer.reach[1, 0] == pytest.approx(0.5, abs=1e-6) and (
        not moves or answer.reach[0, 0] == pytest.approx(-0.5, abs=1e-6)
    )


def test_a_maximised_objective_keeps_its_sign() -> None:
    def hill(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return -(x**2) - (y - 1) ** 2 - x * y, (row(x, lower=limit),)

    problem = toy(hill, sense="maximise", limit=1.0)
    at = found(problem)
    answer = differentiate_by_parameters(at)
    # y* = 1 - x / 2 at x = limit, so that the objective is -(3/4) limit^2 - limit.
    assert answer.objective[0] == pytest.approx(-2.5, abs=1e-8)
    np.testing.assert_allclose(answer.x[:, 0], [1.0, -0.5], atol=1e-8)


def test_rows_that_part_when_the_limit_moves_have_no_derivative() -> None:
    def contrary(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return x**2 + y**2, (row(x, lower=limit), row(x, lower=1 - limit))

    answer = differentiate_by_parameters(found(toy(contrary, limit=0.5)))
    assert not answer.defined[0]
    assert answer.defined[1:].all()


def test_a_flat_optimum_is_refused_with_the_reason() -> None:
    def valley(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return (x + y) ** 2, (row(x, lower=-limit - 5),)

    at = found(toy(valley))
    assert at.reason is not None and "isolated" in at.reason
    with pytest.raises(InputError, match="no sensitivities"):
        differentiate_by_parameters(at)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("nao-dsp", ("dbm_y_mean_limit_m", "heat_loss_W_per_Nm2")),
        ("walk12", ("step_length_m.upper", "lambda")),
    ],
)
def test_slopes_are_those_of_solving_again(name: str, parameters: tuple[str, ...]) -> None:
    problem = load(name, intervals=5) if name == "nao-dsp" else load(name)
    near, at = solved(problem)
    assert at.residual < 1e-12
    answer = differentiate_by_parameters(at)
    names = [parameter.name for parameter in problem.parameters]
    for parameter in parameters:
        i = names.index(parameter)
        objective, x = slope(problem, near, parameter)
        assert answer.objective[i] == pytest.approx(objective, rel=RESOLVED)
        largest = np.abs(answer.x[:, i] / problem.scale).max()
        np.testing.assert_allclose(
            answer.x[:, i] / problem.scale, x / problem.scale, atol=RESOLVED_X * max(largest, 1.0)
        )


def test_a_heavier_robot_by_evaluating_it_is_as_by_solving_it() -> None:
    problem = load("nao-dsp", intervals=5)
    near, at = solved(problem)
    heavier, lighter = (
        load("nao-dsp", intervals=5, robot=f"nao-v5@torso.mass={factor!r}") for factor in (1 + STEP, 1 - STEP)
    )
    answer = differentiate_by_models(at, [(heavier, lighter, 2 * STEP)])
    ends = [sharp(p, near) for p in (heavier, lighter)]
    assert answer.objective[0] == pytest.approx((ends[0].cost - ends[1].cost) / (2 * STEP), rel=RESOLVED)
    np.testing.assert_allclose(answer.x[:, 0], (ends[0].x - ends[1].x) / (2 * STEP), atol=RESOLVED_X)


def test_a_model_with_other_rows_is_refused() -> None:
    at = found(load("walk12"))
    other = load("walk12", intervals=10)
    with pytest.raises(InputError, match="other constraints"):
        differentiate_by_models(at, [(other, other, 1.0)])


def test_a_price_reaches_zero_where_its_limit_ends_to_bind() -> None:
    """(x - 1)^2 + (y - 2)^2 with x <= limit = 0.5: the slope is 2 (limit - 1), up to limit 1; down to x = -2."""
    problem = toy(lambda x, y, limit, ops: ((x - 1) ** 2 + (y - 2) ** 2, (row(x, upper=limit),)), limit=0.5)
    answer = differentiate_by_parameters(found(problem))
    assert answer.objective[0] == pytest.approx(-1.0)
    assert answer.x[:, 0] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert answer.reach[:, 0] == pytest.approx([-2.5, 0.5])


def test_derivatives_by_the_model_are_right_where_its_variables_are_scaled_otherwise() -> None:
    """a (x - 1)^2 + (y - a x)^2 with x <= 0.5: at x = 1/2, y = a/2, the optimum is a/4 and dy/da = 1/2."""

    def model(a: float) -> GaitProblem:
        problem = toy(lambda x, y, limit, ops: (a * (x - 1) ** 2 + (y - a * x) ** 2, (row(x, upper=limit),)), limit=0.5)
        ranges = {"x": (-a, 2.0 * a), "y": (-1.0, 1.0 + 4.0 * a)}  # of a robot's size
        variables = tuple(Variable(name=name, unit="m", lower=low, upper=high) for name, (low, high) in ranges.items())
        return replace(problem, variables=variables)

    middle, half = 1.3, 1e-4
    answer = differentiate_by_models(found(model(middle)), [(model(middle + half), model(middle - half), 2 * half)])
    assert answer.objective[0] == pytest.approx(0.25, rel=1e-6)
    assert answer.x[:, 0] == pytest.approx([0.0, 0.5], abs=1e-6)
