"""Arguments of another kind: one typed error that names the argument, never Python's own from deep inside."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import metaheuristics as search
from nlp_gait import GaitError, IpoptSettings, compile_objective, load, make_solver, solve

WRONG: tuple[Any, ...] = (
    None,
    True,
    1.5,
    -1,
    "2",
    b"2",
    [],
    {},
    np.array([1.0]),
    object(),
    float("nan"),
    10**40,
    1j,
    type,
)
PROBLEM = load("walk12")
OBJECTIVE = compile_objective(PROBLEM)
PSO = search.ParticleSwarm(population=5)


def minimized(**changed: Any) -> Any:
    given: dict[str, Any] = {"objective": OBJECTIVE, "algorithm": PSO, "evaluations": 10, **changed}
    return search.minimize(given.pop("objective"), given.pop("algorithm"), **given)


# Each argument: a call with it, and the values among WRONG that it may take.
CALLS: dict[str, tuple[Callable[[Any], Any], tuple[Any, ...]]] = {
    "problem": (lambda value: solve(value, starts=1), ()),
    "starts": (lambda value: solve(PROBLEM, starts=value), ()),
    "seed": (lambda value: solve(PROBLEM, seed=value), (10**40,)),
    "x given as x0": (lambda value: solve(PROBLEM, x0=value), (None,)),
    "solver": (lambda value: solve(PROBLEM, solver=value), (None,)),
    "progress": (lambda value: solve(PROBLEM, progress=value), (None, type)),
    "problem of compile_objective": (compile_objective, ()),
    "lanes": (lambda value: compile_objective(PROBLEM, lanes=value), (None,)),
    "require_compiler": (lambda value: compile_objective(PROBLEM, require_compiler=value), (True,)),
    "problem by name": (load, ()),
    "solver by name": (make_solver, ()),
    "algorithm by name": (search.make_algorithm, ()),
    "handling by name": (search.make_handling, ()),
    "variable": (PROBLEM.variable_index, ()),
    "parameter": (PROBLEM.value, ()),
    "objective": (lambda value: minimized(objective=value), ()),
    "algorithm": (lambda value: minimized(algorithm=value), ()),
    "handling": (lambda value: minimized(handling=value), (None,)),
    "evaluations": (lambda value: minimized(evaluations=value), (10**40,)),
    "seed of minimize": (lambda value: minimized(seed=value), (10**40,)),
    "time_limit_s": (lambda value: minimized(time_limit_s=value), (None, 1.5, 10**40)),
    "initial": (lambda value: minimized(initial=value), (None,)),
    "callback": (lambda value: minimized(callback=value), (None, type)),
}


@pytest.mark.parametrize("argument", CALLS)
def test_one_typed_error_names_the_argument(argument: str) -> None:
    call, allowed = CALLS[argument]
    for value in WRONG:
        if any(value is taken or (type(value) is type(taken) and value == taken) for taken in allowed):
            continue
        with pytest.raises((GaitError, search.SearchError), match=f"(?i){argument.split()[0]}"):
            call(value)


@pytest.mark.parametrize("settings", [IpoptSettings, "ipopt"])
def test_a_solver_is_one_with_its_settings(settings: Any) -> None:
    with pytest.raises(GaitError, match="nlp_gait.make_solver"):
        solve(PROBLEM, solver=settings)


@pytest.mark.parametrize("bound", [1e308, -1e308, 1e101])
def test_bounds_whose_squares_are_no_numbers_are_refused(bound: float) -> None:
    end = "upper" if bound > 0 else "lower"
    with pytest.raises(GaitError, match=f"step_length_m.{end}"):
        PROBLEM.with_values(**{f"step_length_m.{end}": bound})

    class Wide:
        names = ("x",)
        lower, upper = np.array([min(bound, 0.0)]), np.array([max(bound, 0.0)])

        def __call__(self, X: Any) -> Any:
            return X[:, 0], 0 * X[:, 0]

    with pytest.raises(search.SearchError, match="'x': bounds must be finite"):
        search.minimize(Wide(), PSO)


def test_numpys_whole_numbers_are_whole_numbers() -> None:
    found = solve(PROBLEM, starts=np.int64(1), seed=np.int32(3))  # type: ignore[arg-type]
    assert found.seed == 3 and type(found.seed) is int and found.x == solve(PROBLEM, starts=1, seed=3).x
