"""Plain functions and user-defined objects as algorithms: counted, stopped and judged as all others."""

from collections.abc import Callable
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest
from scipy.optimize import dual_annealing

from metaheuristics import Deb, ParticleSwarm, SearchError, StaticPenalty, minimize, to_algorithm
from metaheuristics.interface import Array
from metaheuristics.user_algorithm import FAILED, INFEASIBLE


class Disk:
    """Least x + y in the unit disk: -sqrt(2)."""

    names = ("x", "y")
    lower, upper = np.full(2, -2.0), np.full(2, 2.0)

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, X: Array) -> tuple[Array, Array]:
        self.calls += len(X)
        return X.sum(axis=1), np.maximum(0.0, (X**2).sum(axis=1) - 1.0)


def annealing(f: Callable[[Array], float], lower: Array, upper: Array, evaluations: int, seed: int) -> None:
    dual_annealing(f, list(zip(lower, upper, strict=True)), maxfun=10 * evaluations, seed=seed)


def test_it_ends_at_its_budget_with_its_best_point() -> None:
    disk = Disk()
    result = minimize(disk, to_algorithm(annealing, "annealing"), evaluations=1500, seed=1)
    assert (result.evaluations, disk.calls, result.reasons) == (1500, 1500, ("evaluation budget used",))
    assert result.feasible and -np.sqrt(2.0) <= result.objective < -1.35
    again = minimize(Disk(), to_algorithm(annealing, "annealing"), evaluations=1500, seed=1)
    np.testing.assert_array_equal(again.x, result.x)
    history = result.history
    assert (
        len(history.evaluations) < 500 and history.evaluations[-1] == 1500 and history.objective[-1] == result.objective
    )


def test_it_may_return_early_and_ask_for_many_points_at_once() -> None:
    def batches(f: Any, lower: Array, upper: Array, evaluations: int, seed: int, *, share: float = 0.5) -> str:
        rng = np.random.default_rng(seed)
        assert f(rng.uniform(lower, upper, (7, 2))).shape == (7,)
        assert isinstance(f([0.0, 0.0]), float)
        f(rng.uniform(lower, upper, (int(share * evaluations), 2)))
        return "ignored"

    result = minimize(Disk(), to_algorithm(batches, "batches"), evaluations=100)
    assert (result.evaluations, result.reasons) == (58, ("the function returned",))
    assert minimize(Disk(), to_algorithm(batches, "b", {"share": 0.2}), evaluations=100).evaluations == 28
    assert minimize(Disk(), to_algorithm(batches, "b", {"share": 5.0}), evaluations=100).evaluations == 100


def test_the_merit_it_receives_orders_points_as_the_rule_does() -> None:
    told: list[float] = []

    def listening(f: Any, lower: Array, upper: Array, evaluations: int, seed: int) -> None:
        told[:] = [f(np.array(x)) for x in ((0.5, 0.0), (2.0, 0.0), (2.0, 2.0), (np.nan, 0.0))]

    minimize(Disk(), to_algorithm(listening, "l"), evaluations=10, handling=Deb())
    assert told == [0.5, INFEASIBLE + 3.0, INFEASIBLE + 7.0, FAILED]
    minimize(Disk(), to_algorithm(listening, "l"), evaluations=10, handling=StaticPenalty(weight=2.0))
    assert told == [0.5, 2.0 + 6.0, 4.0 + 14.0, FAILED]


class Plain:
    """No data class."""

    population = 4

    def __init__(self, width: float = 0.1) -> None:
        self.width = width

    def start(self, start: Any) -> Any:
        return to_algorithm(ParticleSwarm(population=4), "pso").start(start)


def test_objects_classes_and_makers_are_algorithms() -> None:
    def maker(*, population: int = 5) -> ParticleSwarm:
        return ParticleSwarm(population=population)

    assert to_algorithm(ParticleSwarm(), "p", {"population": 7}) == ParticleSwarm(population=7)
    assert to_algorithm(ParticleSwarm, "p", {"population": 7}) == ParticleSwarm(population=7)
    assert to_algorithm(maker, "m", {"population": 9}) == ParticleSwarm(population=9)
    for own in (Plain, Plain()):
        assert minimize(Disk(), to_algorithm(own, "plain"), evaluations=20).evaluations == 20


@pytest.mark.parametrize(
    ("own", "settings", "message"),
    [
        (3, {}, "must be an algorithm with `population` and `start`, or a plain function of \\(f, lower"),
        (
            lambda f: f,
            {},
            "'own' cannot be called as an algorithm: missing a required argument: 'f'; a plain function takes",
        ),
        (Plain(), {"width": 1.0}, "'own' takes no settings, got width: it is not a data class"),
        (type("Odd", (), {"start": print, "population": 2.5}), {}, "population must be a whole number >= 1, got 2.5"),
    ],
)
def test_other_objects_are_rejected(own: Any, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        to_algorithm(own, "own", settings)


class PointDisk(Disk):
    """The same with a function of one point."""

    def point(self, x: Array) -> tuple[float, float]:
        f, violation = self(x[None])
        return float(f[0]), float(violation[0])


@pytest.mark.parametrize("handling", [Deb(), StaticPenalty(weight=2.0)])
def test_the_fast_way_for_one_point_changes_nothing(handling: Any) -> None:
    def walk(f: Any, lower: Array, upper: Array, evaluations: int, seed: int) -> None:
        rng, x = np.random.default_rng(seed), np.zeros(2)
        values.append(f(np.array([np.nan, 0.0])))
        while True:
            y = np.clip(x + rng.normal(0.0, 0.3, 2), lower, upper)
            values.append(f(y))
            x = y if values[-1] < f(x) else x

    results, told = [], []
    for disk in (Disk(), PointDisk()):
        values: list[float] = []
        results.append(minimize(disk, to_algorithm(walk, "walk"), evaluations=200, handling=handling))
        told.append(values)
        assert disk.calls == 200
    slow, fast = results
    assert told[0] == told[1] and len(told[0]) > 90
    np.testing.assert_array_equal(slow.x, fast.x)
    np.testing.assert_array_equal(slow.history.objective, fast.history.objective)
    assert (slow.failed_evaluations, fast.failed_evaluations) == (1, 1)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")  # Python's own hook is silent
def test_eight_threads_call_f_and_all_are_counted() -> None:
    def threads(f: Any, lower: Array, upper: Array, evaluations: int, seed: int) -> None:
        def walk(seed: int) -> None:
            rng = np.random.default_rng(seed)
            while True:
                f(rng.uniform(lower, upper))

        workers = [Thread(target=walk, args=(seed,)) for seed in range(8)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()

    disk = PointDisk()
    result = minimize(disk, to_algorithm(threads, "threads"), evaluations=500)
    assert (result.evaluations, disk.calls, result.reasons) == (500, 500, ("evaluation budget used",))


def test_a_bare_except_does_not_outlast_the_budget() -> None:
    def deaf(f: Any, lower: Array, upper: Array, evaluations: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        while True:
            try:
                f(rng.uniform(lower, upper))
            except:  # noqa: E722
                pass

    disk = Disk()
    result = minimize(disk, to_algorithm(deaf, "deaf"), evaluations=100)
    assert (result.evaluations, disk.calls, result.reasons) == (100, 100, ("evaluation budget used",))


def test_a_function_that_hangs_ends_at_the_time_limit_with_its_best_point() -> None:
    def hanging(f: Any, lower: Array, upper: Array, evaluations: int, seed: int) -> None:
        for share in share_of_calls:
            f(share * np.ones(2))
        Event().wait()

    share_of_calls = [0.5, -0.5, 0.1]
    algorithm = to_algorithm(hanging, "hanging")
    result = minimize(Disk(), algorithm, evaluations=100, time_limit_s=0.2)
    assert (result.evaluations, result.objective, result.reasons) == (3, -1.0, ("time limit reached",))
    share_of_calls = []
    with pytest.raises(SearchError, match="f was never called: time limit reached"):
        minimize(Disk(), algorithm, evaluations=100, time_limit_s=0.2)


@pytest.mark.parametrize(
    ("search", "error", "message"),
    [
        (lambda f, lower, upper, evaluations, seed: 1 / f(0 * lower), ZeroDivisionError, "division by zero"),
        (lambda f, lower, upper, evaluations, seed: lower, SearchError, "f was never called: the function returned"),
        (lambda f, lower, upper, evaluations, seed: f(lower[:1]), SearchError, r"f takes one point of shape \(2,\)"),
    ],
)
def test_an_error_of_the_function_is_its_own_and_wrong_calls_are_named(
    search: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        minimize(Disk(), to_algorithm(search, "own"), evaluations=100)
