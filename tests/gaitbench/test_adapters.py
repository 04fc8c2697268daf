"""Every adapter with the real package: the same values, bounds and best point, and an optimiser of that package on it."""

import pickle
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.errors import MissingExtraError, UnknownNameError
from nlp_gait.formulation import Array

ID = "ssp-v5"


@pytest.fixture(scope="module")
def instance() -> gaitbench.Instance:
    return gaitbench.load(ID)


@pytest.fixture(scope="module")
def X(instance: gaitbench.Instance) -> Array:
    return np.random.default_rng(5).uniform(instance.lower, instance.upper, (40, len(instance.names)))


@pytest.mark.parametrize("rows", [False, True])
def test_pymoo(instance: gaitbench.Instance, X: Array, rows: bool) -> None:
    """Objective and constraints of a population; pymoo's own sum of violations is ours."""
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.optimize import minimize

    problem = instance.to("pymoo", rows=rows) if rows else instance.to("pymoo")
    assert (problem.n_var, problem.n_obj) == (9, 1)
    assert problem.n_ieq_constr == (len(instance.row_names) if rows else 1)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    f, violation = instance(X)
    np.testing.assert_array_equal(F[:, 0], f)
    np.testing.assert_allclose(np.maximum(G, 0.0).sum(axis=1), violation, rtol=1e-12)
    assert problem.pareto_front()[0][0] == instance.best_known
    again = pickle.loads(pickle.dumps(problem))
    np.testing.assert_array_equal(again.evaluate(X, return_values_of=["F"]), F)
    result = minimize(problem, GA(pop_size=20), ("n_gen", 15), seed=1, verbose=False)
    assert result.F[0] >= instance.best_known and result.CV[0] == 0.0


def test_scipy_ends_at_the_best_known(instance: gaitbench.Instance) -> None:
    """SLSQP with our gradients, from beside the best known point."""
    from scipy.optimize import minimize

    middle = (instance.lower + instance.upper) / 2
    beside = middle + 0.9 * (instance.best_x - middle)
    result = minimize(**instance.to("scipy"), x0=beside, method="SLSQP", options={"maxiter": 500, "ftol": 1e-12})
    assert result.success, result.message
    assert result.fun == pytest.approx(instance.best_known, rel=1e-5)


def test_pycma(instance: gaitbench.Instance, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The worst row of each group; with it ``fmin_con2`` gets to a feasible point."""
    import cma  # takes a second, and so does SciPy's statistics, which it imports

    monkeypatch.chdir(tmp_path)  # pycma makes a folder there
    arguments = instance.to("cma")
    constraints = arguments["constraints"](instance.best_x)
    assert 5 <= len(constraints) <= 15 and max(constraints) <= 0.0
    middle = np.array(arguments["x0"])
    assert max(arguments["constraints"](middle)) == instance.rows(middle[None]).max()
    options = {**arguments.pop("options"), "maxfevals": 2000, "seed": 1, "verbose": -9, "verb_log": 0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of an archive that needs one more package
        _, strategy = cma.fmin_con2(**arguments, options=options)
    best = strategy.objective_function.best_feas.x
    assert best is not None and instance(np.array(best)[None])[1][0] == 0.0


@pytest.mark.parametrize("name", ["pymoo", "ioh", "cma"])
def test_a_package_that_lacks_is_named(
    name: str, instance: gaitbench.Instance, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingExtraError, match=rf"to\('{name}'\) needs the package {name}.*nlp-gait\[algorithms\]"):
        instance.to(name)
    with pytest.raises(UnknownNameError, match=f"unknown adapter '{name}x'; did you mean '{name}'"):
        instance.to(f"{name}x")
