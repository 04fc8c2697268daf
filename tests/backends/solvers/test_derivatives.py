"""Compiled functions for IPOPT: the interpreted ones' values, and the same optimum."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import MX

from nlp_gait.backends.solvers.derivatives import compiled_functions, compiled_nlp, one_direction_at_a_time

OPTIONS = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
X, P = MX.sym("x", 2), MX.sym("p")
ROSENBROCK = {"x": X, "p": P, "f": (1 - X[0]) ** 2 + P * (X[1] - X[0] ** 2) ** 2, "g": ca.sumsqr(X)}


@pytest.mark.parametrize("optimise", [False, True])
def test_functions_give_the_same_values(optimise: bool) -> None:
    value = ca.Function("value", [X, P], [ROSENBROCK["f"]])
    slope = ca.Function("slope", [X, P], [ca.jacobian(ROSENBROCK["f"], X)], ["x", "p"], ["J"])
    compiled = compiled_functions([value, slope], optimise=optimise)
    assert [function.class_name() for function in compiled] == ["External"] * 2
    for before, after in zip((value, slope), compiled, strict=True):
        assert np.array_equal(np.array(before([0.3, -0.7], 90.0)), np.array(after([0.3, -0.7], 90.0)))
    assert compiled[1].name_out() == ["J"]


def test_a_solver_of_compiled_functions_takes_the_same_path() -> None:
    interpreted = ca.nlpsol("interpreted", "ipopt", ROSENBROCK, OPTIONS)
    nlp, options = compiled_nlp(interpreted, ROSENBROCK)
    compiled = ca.nlpsol("compiled", "ipopt", nlp, {**OPTIONS, **options})
    ends = [solver(x0=[-1.0, 1.0], p=100.0, ubg=1.0) for solver in (interpreted, compiled)]
    assert np.array_equal(np.array(ends[0]["x"]), np.array(ends[1]["x"]))
    assert interpreted.stats()["iter_count"] == compiled.stats()["iter_count"] > 3


def test_derivatives_one_direction_at_a_time_are_the_same() -> None:
    before = ca.GlobalOptions.getMaxNumDir()
    solvers = [ca.nlpsol("usual", "ipopt", ROSENBROCK, OPTIONS)]
    with one_direction_at_a_time():
        assert ca.GlobalOptions.getMaxNumDir() == 1
        solvers.append(ca.nlpsol("one", "ipopt", ROSENBROCK, OPTIONS))
    assert ca.GlobalOptions.getMaxNumDir() == before
    usual, one = (solver.get_function("nlp_hess_l")([0.3, -0.7], 90.0, 1.0, 0.5) for solver in solvers)
    assert np.array(one) == pytest.approx(np.array(usual), rel=1e-14)
