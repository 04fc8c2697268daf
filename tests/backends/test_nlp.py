"""The lifted NLP: its derivatives, its agreement with the exact functions, and lifting against the sense."""

import casadi as ca
import numpy as np
import pytest
from casadi import MX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError, LiftedSenseError
from nlp_gait.formulation import Constraint, load
from nlp_gait.symbolic.nonsmooth import Exact, Lifted, Nonsmooth
from tests.backends.toys import Mathematics, row, toy

NAMES = ("nao-ssp", "nao-dsp")
WIDTH = 1e-3
# Sums of the same products in another order.
ROUNDING = 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_with_lifted_variables_at_their_exact_values_the_nlp_is_the_exact_problem(name: str) -> None:
    """At a reachable point, and away from the jump that single support smooths."""
    problem = load(name)
    model, exact = build_nlp(problem), build_exact_model(problem)
    x = np.array([0.3, 0.0, 0.0, 0.01, 0.02, 0.02, -0.02, 0.02, 2.0])[: model.variables]
    if name == "nao-dsp":
        x[-1] = 1.0
    w = model.start(problem, x, WIDTH)
    values = ca.Function("values", [model.nlp["x"], model.nlp["p"]], [model.nlp["f"], model.nlp["g"]])
    f, g = (np.array(value).ravel() for value in values(w, np.append(problem.p, WIDTH)))
    values_at = exact.at(x, problem.p)
    assert f[0] == pytest.approx(values_at.cost, rel=ROUNDING)
    smoothed = np.array([name.startswith("dbm_x") for name in model.row_names]) & model.smoothed
    count = len(model.row_names)
    np.testing.assert_allclose(g[:count][~smoothed], values_at.g[:count][~smoothed], rtol=0, atol=ROUNDING)
    assert g[count:].min() == pytest.approx(0.0, abs=ROUNDING)  # the rows of the lifts hold, some tightly
    assert exact.row_names[:count] == model.row_names
    lower, upper = (np.array(bound).ravel() for bound in model.row_bounds(problem.p))
    np.testing.assert_array_equal(lower, values_at.lower[:count])
    np.testing.assert_array_equal(upper, values_at.upper[:count])


GOOD: dict[str, Mathematics] = {
    "abs minimised": lambda x, y, limit, ops: (ops.abs(x) + y**2, ()),
    "min maximised": lambda x, y, limit, ops: (-ops.min(x, y), ()),
    "abs bounded from above": lambda x, y, limit, ops: (x + y, (row(ops.abs(x), upper=limit),)),
    "min of a min": lambda x, y, limit, ops: (x + y, (row(ops.min(ops.min(x, y), 2 - x), lower=limit),)),
    "min of minus an abs": lambda x, y, limit, ops: (y, (row(ops.min(-ops.abs(x), y), lower=-limit),)),
}
BAD: dict[str, tuple[Mathematics, str]] = {
    "abs maximised": (lambda x, y, limit, ops: (-ops.abs(x), ()), "the objective"),
    "min minimised": (lambda x, y, limit, ops: (ops.min(x, y), ()), "the objective"),
    "abs bounded from below": (lambda x, y, limit, ops: (x, (row(ops.abs(x), lower=limit),)), "row row gains"),
    "abs held at a value": (lambda x, y, limit, ops: (x, (row(ops.abs(x), limit, limit),)), "row row gains"),
    "min of an abs": (lambda x, y, limit, ops: (-ops.min(ops.abs(x), y), ()), "another abs or min gains"),
    "abs of a difference from an abs": (lambda x, y, limit, ops: (ops.abs(ops.abs(x) - 1), ()), "another abs or min"),
}


@pytest.mark.parametrize("mathematics", GOOD.values(), ids=GOOD.keys())
def test_lifting_along_the_sense_is_exact_at_the_optimum(mathematics: Mathematics) -> None:
    solution = solve(toy(mathematics), starts=2)
    assert solution.converged
    exact = np.array([start.objective for start in solution.starts if start.converged])
    grid = np.array(np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-1, 3, 41))).reshape(2, -1).T
    problem = toy(mathematics)
    at = [build_exact_model(problem).at(x, problem.p) for x in grid]
    searched = [values.cost for values in at if values.violation <= ROUNDING]
    assert exact.min() == pytest.approx(min(searched), abs=1e-6)  # every optimum here lies on the grid


@pytest.mark.parametrize(("mathematics", "where"), BAD.values(), ids=BAD.keys())
def test_lifting_against_the_sense_is_an_error(mathematics: Mathematics, where: str) -> None:
    with pytest.raises(LiftedSenseError, match=f"toy: .*{where}.*the lifted NLP would be wrong"):
        build_nlp(toy(mathematics))


def test_operations_take_samples_of_several_joints() -> None:
    """(k, N + 1) arrays, as an objective or a row over all samples is written; at x = y = 1 by hand."""

    def mathematics(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        t = ca.linspace(0.0, 1.0, 4).T
        samples = ca.vertcat(x * (1 - t), y * (t - 0.5), x - y + 0 * t)  # (3, 4)
        least = ops.min(samples[0, :], 3 * y + 0 * t, 2 - x)
        return ca.sum2(ca.sum1(ops.abs(samples))) - ca.sum2(least), (row(ops.largest(samples), upper=1 + limit),)

    problem = toy(mathematics)
    exact, model = build_exact_model(problem), build_nlp(problem)
    expected = 2.0 + 2 * (0.5 + 1 / 6) - 2.0  # |1 - t| and |t - 1/2| at 0, 1/3, 2/3 and 1, less min(1 - t, 3, 1)
    assert exact.at([1.0, 1.0], problem.p).cost == pytest.approx(expected)
    assert exact.at([1.0, 1.0], problem.p).g[0] == pytest.approx(1.0)
    values = ca.Function("values", [model.nlp["x"], model.nlp["p"]], [model.nlp["f"]])
    w = model.start(problem, np.array([1.0, 1.0]), WIDTH)
    assert float(values(w, np.append(problem.p, WIDTH))) == pytest.approx(expected)
    solution = solve(problem, starts=3)
    assert solution.converged
    assert solution.objective == pytest.approx(exact.at(solution.best.x, problem.p).cost)


@pytest.mark.parametrize("interpretation", [Exact(), Lifted(MX(1e-3))])
def test_shapes_that_differ_are_one_sentence(interpretation: Nonsmooth) -> None:
    row_vector, column = MX.sym("a", 1, 3), MX.sym("b", 3)
    with pytest.raises(InputError, match=r"ops.min takes arrays of one shape, or scalars, got \(1, 3\) and \(3, 1\)"):
        interpretation.min(row_vector, column)
    with pytest.raises(InputError, match="ops.step takes arrays of one shape"):
        interpretation.step(row_vector, column, MX(1.0))
    assert interpretation.min(row_vector, MX(2.0)).shape == (1, 3)
