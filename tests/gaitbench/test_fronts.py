"""Instances with two objectives: their true fronts, measures of distance from them, and adapters."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.errors import UnknownNameError
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.gaitbench.fronts import REFERENCE, FrontInstance, compute_hypervolume, load_points
from tests.compilers import hide_compilers


@pytest.fixture(scope="module")
def walk() -> FrontInstance:
    return gaitbench.load_front("walk12-stability-step")


def test_every_instance_has_a_front() -> None:
    points = load_points()
    assert len(gaitbench.list_fronts()) >= 8 and set(points) == set(gaitbench.list_fronts())
    assert all(len(front) >= 30 for front in points.values())


@pytest.mark.parametrize("id", ["walk12-fast-stability-step", "dsp-power-time"])  # all: benchmarks.gaitbench.fronts
def test_every_point_of_a_true_front_is_feasible_and_none_betters_another(
    id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide_compilers(monkeypatch)
    instance = FrontInstance(id)
    assert len(instance.front) >= 30 and (instance.front_violation <= FEASIBILITY_TOLERANCE).all()
    assert instance.front.min() == 0.0 and instance.front.max() == 1.0
    first, second = instance.front.T
    assert (np.diff(first) > 0.0).all() and (np.diff(second) < 0.0).all()


def test_measures_of_a_front_itself_and_of_points_beside_it(walk: FrontInstance) -> None:
    own = walk.measure(walk.front)
    assert own.igd_plus == 0.0 and own.epsilon == 0.0 and 0.97 < own.hypervolume <= 1.0 + 1e-12
    worse = walk.measure(walk.front + 0.1)
    assert (
        worse.epsilon == pytest.approx(0.1)
        and 0.05 < worse.igd_plus <= 0.1 * 2**0.5
        and worse.hypervolume < own.hypervolume
    )
    nothing = walk.measure(np.empty((0, 2)))
    assert nothing.hypervolume == 0.0 and nothing.igd_plus == nothing.epsilon == np.inf


def test_measures_are_those_of_pymoo(walk: FrontInstance) -> None:
    pytest.importorskip("pymoo", reason="pymoo is not installed: pip install 'nlp-gait[algorithms]'")
    from pymoo.indicators.hv import HV
    from pymoo.indicators.igd_plus import IGDPlus

    F = np.random.default_rng(0).uniform(0.0, 1.3, (40, 2))
    assert compute_hypervolume(F, REFERENCE) == pytest.approx(HV(ref_point=np.full(2, REFERENCE))(F))
    assert walk.measure(F).igd_plus == pytest.approx(IGDPlus(walk.front)(F))
    problem = walk.to("pymoo")
    assert (problem.n_obj, problem.n_ieq_constr) == (2, 1)
    out = problem.evaluate(walk.front_x, return_as_dictionary=True)
    assert out["F"] == pytest.approx(walk.front) and (out["G"] <= FEASIBILITY_TOLERANCE).all()
    assert np.array_equal(problem.pareto_front(), walk.front)


def test_pygmo_moves_along_the_front(walk: FrontInstance) -> None:
    pygmo = pytest.importorskip("pygmo", reason="pygmo is not installed: pip install 'nlp-gait[suites]'")
    problem = walk.to("pygmo")
    assert problem.get_nobj() == 2 and problem.fitness(walk.front_x[3]) == pytest.approx(walk.front[3], abs=1e-5)
    population = pygmo.algorithm(pygmo.nsga2(gen=20, seed=1)).evolve(pygmo.population(problem, size=24, seed=1))
    assert walk.measure(population.get_f()).hypervolume > 0.8


def test_objectives_are_in_physical_units_and_an_instance_is_picklable(walk: FrontInstance) -> None:
    values, violation = walk.evaluate(walk.front_x)
    assert violation.max() <= FEASIBILITY_TOLERANCE
    assert -values[:, 1] == pytest.approx(walk.front_x[:, walk.names.index("step_length_m")])  # to be maximised
    assert pickle.loads(pickle.dumps(walk)) is walk
    with pytest.raises(UnknownNameError, match="walk12-stability-step"):
        gaitbench.load_front("walk12-stability-stop")
