"""What drives ours and is no part of the README's environment: ioh."""

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.formulation import Array
from tests.extras import need

ID = "ssp-v5"
BUDGET = 10_000
SOLVERS = ("pso", "random", "de")


@pytest.fixture(scope="module")
def ioh() -> Any:
    need("ioh")
    return import_module("ioh")


@pytest.fixture(scope="module")
def instance() -> gaitbench.Instance:
    return gaitbench.load(ID)


@pytest.fixture(scope="module")
def X(instance: gaitbench.Instance) -> Array:
    return np.random.default_rng(5).uniform(instance.lower, instance.upper, (40, len(instance.names)))


def test_ioh(ioh: Any, instance: gaitbench.Instance, X: Array) -> None:
    """Bounds of each variable, the optimum, and a soft constraint that makes an infeasible point dear."""
    problem = instance.to("ioh")
    np.testing.assert_array_equal(problem.bounds.lb, instance.lower)
    np.testing.assert_array_equal(problem.bounds.ub, instance.upper)
    assert problem.optimum.y == instance.best_known
    np.testing.assert_array_equal(problem.optimum.x, instance.best_x)
    assert problem(instance.best_x.tolist()) == pytest.approx(instance.best_known, rel=1e-12)
    f, violation = instance(X)
    for x, fi, vi in zip(X.tolist(), f, violation, strict=True):
        expected = fi + 1e3 * abs(instance.best_known) * vi
        assert problem(x) == pytest.approx(expected, rel=1e-12)
    assert problem.state.evaluations == 1 + len(X)
    assert problem.meta_data.name == f"GaitBench-{ID}" and problem.meta_data.n_variables == 9


def test_ioh_keeps_instances_apart(ioh: Any) -> None:
    """Two that were wrapped one after the other: each has its own functions."""
    first, second = gaitbench.load("walk12-w015").to("ioh"), gaitbench.load("walk12-w100").to("ioh")
    for problem, id in ((first, "walk12-w015"), (second, "walk12-w100")):
        instance = gaitbench.load(id)
        assert problem(instance.best_x.tolist()) == pytest.approx(instance.best_known, rel=1e-12)
