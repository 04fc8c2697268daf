"""What reads or drives ours and is no part of the README's environment: pygmo, ioh and iohinspector."""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.analysis.comparison import Comparison
from compare.analysis.record_statistics import compute_ecdf
from compare.logs import write_ioh
from nlp_gait import gaitbench
from nlp_gait.formulation import Array
from tests.compare.test_logs import compare_baselines
from tests.extras import need

need("iohinspector")  # first, for the others have no wheel on some machines

ID = "ssp-v5"
BUDGET = 10_000
TARGETS = 2_001  # of our distribution; iohinspector's has no end of them
SOLVERS = ("pso", "random", "de")


@pytest.fixture(scope="module")
def ioh() -> Any:
    return need("ioh")


@pytest.fixture(scope="module")
def pygmo() -> Any:
    return need("pygmo")


@pytest.fixture(scope="module")
def comparisons() -> list[Comparison]:
    return compare_baselines()


@pytest.fixture(scope="module")
def instance() -> gaitbench.Instance:
    return gaitbench.load(ID)


@pytest.fixture(scope="module")
def X(instance: gaitbench.Instance) -> Array:
    return np.random.default_rng(5).uniform(instance.lower, instance.upper, (40, len(instance.names)))


@pytest.mark.slow
def test_pygmo(pygmo: Any, instance: gaitbench.Instance, X: Array) -> None:
    """Objective, rows and gradients; a copy in an archipelago's thread and a gradient solver work on it."""
    problem = instance.to("pygmo")
    assert (problem.get_nx(), problem.get_nic(), problem.has_gradient()) == (9, len(instance.row_names), True)
    values = np.array([problem.fitness(x) for x in X])
    np.testing.assert_array_equal(values[:, 0], instance(X)[0])
    np.testing.assert_array_equal(values[:, 1:], instance.rows(X))
    np.testing.assert_array_equal(problem.batch_fitness(X.ravel()), values.ravel())
    np.testing.assert_array_equal(problem.gradient(X[0])[:9], instance.gradient(X[0]))
    assert problem.feasibility_x(instance.best_x)
    assert np.allclose(copy.deepcopy(problem).fitness(X[0]), values[0])
    population = pygmo.population(problem, 0, seed=1)
    population.push_back(instance.best_x + 0.02 * (instance.lower + instance.upper - 2 * instance.best_x))
    solver = pygmo.algorithm(pygmo.nlopt("slsqp"))
    found = solver.evolve(population).champion_f[0]
    assert found == pytest.approx(instance.best_known, rel=1e-3)


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


def loaded(folder: Path) -> Any:
    """Manager and data of a folder, as iohinspector reads them."""
    import iohinspector

    manager = iohinspector.DataManager()
    manager.add_folder(str(folder))
    return manager, manager.load(monotonic=True, include_columns=["algorithm_name", "function_id"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # iohinspector and what it imports warn of their own
def test_iohinspector_finds_our_numbers(comparisons: list[Comparison], tmp_path: Path) -> None:
    """Expected running times exactly; the distribution as finely as targets are taken."""
    write_ioh(comparisons, tmp_path)
    manager, data = loaded(tmp_path)
    from iohinspector.metrics.ecdf import get_data_ecdf
    from iohinspector.metrics.fixed_target import aggregate_running_time

    assert len(manager.overview) == sum(len(comparison.records) for comparison in comparisons)
    compared = 0
    for number, comparison in enumerate(comparisons, start=1):
        for solver in comparison.solvers:
            if solver.name not in SOLVERS:
                continue
            rows = data.filter((data["algorithm_name"] == solver.name) & (data["function_id"] == number))
            table = aggregate_running_time(rows, f_min=1e-6, f_max=1.0, eval_max=BUDGET)
            for target, found in zip(table["raw_y"], table["ERT"], strict=True):
                ours = solver.expected_cost(float(target))
                assert found == pytest.approx(ours, rel=1e-12) or (math.isinf(found) and math.isinf(ours))
                compared += math.isfinite(ours)
            at = [100, 1000, BUDGET]
            shares = get_data_ecdf(rows, f_min=1e-6, f_max=1.0, eval_values=at)
            targets = np.logspace(0.0, -6.0, TARGETS)
            costs = np.array([[c.cost_to_reach(t) for t in targets] for c in solver.curves]).ravel()
            cost, share = compute_ecdf(costs)
            ours_at = [float(share[cost <= count][-1]) if (cost <= count).any() else 0.0 for count in at]
            np.testing.assert_allclose(shares["eaf"], ours_at, atol=1.0 / (TARGETS - 1))
    assert compared > 100


def test_the_header_is_what_ioh_itself_writes(ioh: Any, comparisons: list[Comparison], tmp_path: Path) -> None:
    """The same keys as in a file of ioh's own logger."""
    logger = ioh.logger.Analyzer(root=str(tmp_path), folder_name="theirs", algorithm_name="a", algorithm_info="b")
    problem = ioh.get_problem(1, 1, 2)
    problem.attach_logger(logger)
    for x in ([0.0, 0.0], [1.0, 1.0]):
        problem(x)
    problem.reset()
    logger.close()
    theirs = json.loads(next((tmp_path / "theirs").glob("*.json")).read_text())
    path = write_ioh(comparisons[:1], tmp_path / "ours")[0]
    ours = json.loads(path.read_text())
    assert set(ours) <= set(theirs) and set(theirs) - set(ours) <= {"experiment_attributes"}
    assert set(ours["scenarios"][0]) == set(theirs["scenarios"][0])
    assert set(ours["scenarios"][0]["runs"][0]) <= set(theirs["scenarios"][0]["runs"][0])
    assert set(ours["algorithm"]) == set(theirs["algorithm"])
