"""The compiled objective: the virtual machine's numbers at every lane count, whatever the batch or the memory."""

import functools
from dataclasses import replace
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import CompiledObjective, InterpretedRows, compile_objective
from nlp_gait.backends.kernel.compiler import native_lanes
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from tests.backends.toys import corner, toy

# glibc's vector functions are off by up to 4 units in the last place, and torques are sums of cancelling terms.
COST_TOLERANCE, ROW_TOLERANCE = 1e-12, 1e-11
CANDIDATES = 1000
LANES = [lanes for lanes in (1, 2, 4, 8) if lanes <= native_lanes()]
# One lane and the widest for one problem; of the other, whose phase has other rows, the widest alone.
AGREEING = [("nao-ssp", LANES[0]), ("nao-ssp", LANES[-1]), ("nao-dsp", LANES[-1])]


@functools.cache
def problem_named(name: str) -> GaitProblem:
    return nlp_gait.load(name)


@functools.cache
def read_objective(name: str, lanes: int | None = None) -> CompiledObjective:
    return compile_objective(problem_named(name), require_compiler=True, lanes=lanes)


def candidates(problem: GaitProblem, count: int = CANDIDATES, seed: int = 0) -> Array:
    """Half of them within the bounds, half up to a range's width outside, mostly out of reach."""
    rng = np.random.default_rng(seed)
    inside = rng.uniform(problem.lower, problem.upper, (count // 2, len(problem.names)))
    width = problem.upper - problem.lower
    outside = rng.uniform(problem.lower - width, problem.upper + width, (count - count // 2, len(problem.names)))
    return np.concatenate([inside, outside])


@functools.cache
def expected(name: str) -> tuple[Array, Array, Array]:
    """Cost, violation and rows from CasADi's virtual machine."""
    problem = problem_named(name)
    exact = build_exact_model(problem).function.map(CANDIDATES)
    cost, violation, g, *_ = exact(candidates(problem).T, np.repeat(problem.p[:, None], CANDIDATES, axis=1))
    return np.array(cost).ravel(), np.array(violation).ravel(), np.array(g).T


@pytest.mark.parametrize(("name", "lanes"), AGREEING)
def test_agrees_with_the_virtual_machine(name: str, lanes: int) -> None:
    objective, X = read_objective(name, lanes), candidates(problem_named(name))
    cost, violation, g = expected(name)
    f, total = objective(X)
    rows = objective.constraints(X)
    assert np.isfinite(f).all() and np.isfinite(rows).all()
    assert np.array_equal(f[-3:], objective(X[-3:])[0])  # whatever the size of the batch
    assert (violation[: CANDIDATES // 2] > 0).any()
    np.testing.assert_allclose(f, cost, rtol=COST_TOLERANCE)
    assert (np.abs(rows - g) <= ROW_TOLERANCE * np.abs(g).max(axis=0)).all()
    np.testing.assert_allclose(total, violation, rtol=ROW_TOLERANCE, atol=ROW_TOLERANCE)


def test_takes_any_memory_and_leaves_it_as_it_was() -> None:
    problem = problem_named("nao-ssp")
    objective, X = read_objective("nao-ssp"), candidates(problem, 21)
    f, violation = objective(X)
    raw = np.zeros(X.nbytes + 1, dtype=np.uint8)
    misaligned = raw[1:].view(np.float64).reshape(X.shape)
    misaligned[:] = X
    assert not misaligned.flags.aligned
    strided = np.repeat(X, 2, axis=1)[:, ::2]
    locked = X.copy()
    locked.setflags(write=False)
    for given in (misaligned, strided, np.asfortranarray(X), locked, X.astype(">f8")):
        before = given.copy()
        got = objective(given)
        assert np.array_equal(got[0], f) and np.array_equal(got[1], violation)
        assert np.array_equal(given, before)
    single = X.astype(np.float32)
    assert np.array_equal(objective(single)[0], objective(single.astype(float))[0])
    assert objective(np.ones(X.shape, dtype=int))[0].shape == (21,)
    assert objective(X.tolist())[0].tolist() == f.tolist()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_row_that_is_not_finite_fails_alone(bad: float) -> None:
    objective, X = read_objective("nao-ssp"), candidates(problem_named("nao-ssp"), 20)
    f, violation = objective(X)
    X[7, 3] = bad
    got_f, got_violation = objective(X)
    assert got_f[7] == got_violation[7] == np.inf
    others = np.arange(20) != 7
    assert np.array_equal(got_f[others], f[others])
    assert np.array_equal(got_violation[others], violation[others])


@pytest.mark.parametrize("X", [np.zeros(9), np.zeros((2, 8)), np.zeros((1, 2, 9))])
def test_says_which_shape_it_wants(X: Array) -> None:
    with pytest.raises(InputError, match="one candidate per row and 9 columns .*hip_height_m.*got shape"):
        read_objective("nao-ssp")(X)


def test_refuses_impossible_settings() -> None:
    with pytest.raises(InputError, match="lanes must be 1, 2, 4 or 8, got 3"):
        compile_objective(problem_named("nao-ssp"), lanes=3)


def test_parameters_change_without_a_new_library(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_named("nao-ssp")
    before = read_objective("nao-ssp")
    X = candidates(problem, 40)
    f, violation = before(X)
    monkeypatch.setattr("nlp_gait.backends.kernel.compiled.load_library", None)  # would raise if it were called
    strict = compile_objective(problem.with_values(torque_change_limit_Nm=0.1, heat_loss_W_per_Nm2=0.05))
    strict_f, strict_violation = strict(X)
    assert (strict_f > f).all() and (strict_violation > violation).all()
    assert np.array_equal(before(X)[0], f)
    fixed = compile_objective(problem.fix(swing_height_m=0.024))
    assert fixed.lower[7] == fixed.upper[7] == 0.024
    assert fixed.names == problem.names
    value = build_exact_model(problem).at(X[0], strict.problem.p).cost
    assert strict_f[0] == pytest.approx(value, rel=COST_TOLERANCE)


def test_interpreted_gives_the_same(request: pytest.FixtureRequest, caplog: pytest.LogCaptureFixture) -> None:
    problem = problem_named("nao-ssp")
    X = candidates(problem, 70)
    X[3, 0] = np.nan
    compiled = read_objective("nao-ssp")
    request.getfixturevalue("without_compiler")
    interpreted = compile_objective(problem)
    assert (compiled.backend, interpreted.backend) == ("compiled", "interpreted")
    assert len(caplog.messages) == 1
    assert "no C++ compiler" in caplog.messages[0] and "pip install ziglang" in caplog.messages[0]
    f, violation = interpreted(X)
    expected_f, expected_violation = compiled(X)
    np.testing.assert_allclose(f, expected_f, rtol=COST_TOLERANCE)
    np.testing.assert_allclose(violation, expected_violation, rtol=ROW_TOLERANCE, atol=ROW_TOLERANCE)
    others = np.arange(70) != 3
    rows = compiled.constraints(X)[others]
    assert (np.abs(interpreted.constraints(X)[others] - rows) <= ROW_TOLERANCE * np.abs(rows).max(axis=0)).all()
    with pytest.raises(nlp_gait.GaitError, match="no C\\+\\+ compiler"):
        compile_objective(problem, require_compiler=True)


def test_the_sanitizer_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Undefined behaviour, misaligned access included, ends the process; the address sanitizer needs a run by hand."""
    flags = ("-std=c++17", "-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all", "-fvisibility=hidden", "-w")
    monkeypatch.setattr("nlp_gait.backends.kernel.compiled.BASE_FLAGS", flags)
    try:
        objective = compile_objective(toy(corner), require_compiler=True)
    except nlp_gait.GaitError:
        pytest.skip("this compiler has no sanitizer")
    raw = np.ones(2 * 8 * 21 + 1, dtype=np.uint8)
    misaligned = raw[1:].view(np.float64).reshape(21, 2)
    misaligned[:] = 1.0
    for count in (1, 8, 21):
        f, violation = objective(misaligned[:count])
        assert (f == 0.0).all() and (violation == 0.0).all()


@pytest.mark.parametrize("lanes", LANES[1:][-1:])
def test_what_amplifies_rounding_is_the_same_on_many_lanes_as_on_one(lanes: int) -> None:
    """In the tracked step a rounding error decides steps of the controller: with vector functions 5 % of candidates differ."""
    assert problem_named("stairs-track").hints.amplifies_rounding
    mild = toy(lambda x, y, limit, ops: (ca.sin(10 * x) * ca.exp(y), ()))
    X, hints = candidates(mild), replace(mild.hints, amplifies_rounding=True)
    one, several = (compile_objective(replace(mild, hints=hints), lanes=n, require_compiler=True) for n in (1, lanes))
    assert all(np.array_equal(a, b) for a, b in zip(one(X), several(X), strict=True))
    assert np.array_equal(one.constraints(X), several.constraints(X))


@pytest.mark.parametrize(
    "given",
    [
        np.zeros((1, 9), dtype=complex),
        np.ma.masked_array(np.zeros((1, 9)), mask=np.eye(1, 9)),
        np.full((1, 9), "0.1"),
        np.ones((1, 9), dtype=bool),
        np.full((1, 9), None),
        [[0.1] * 8 + [True]],
    ],
    ids=["complex", "masked", "text", "true", "none", "true among numbers"],
)
def test_what_numpy_would_make_numbers_of_in_silence_is_refused(given: Any) -> None:
    problem, objective = problem_named("nao-ssp"), read_objective("nao-ssp")
    for refuse in (
        lambda: objective(given),
        lambda: objective.constraints(given),
        lambda: problem.check_x(given[0]),
        lambda: problem.signals(given[0]),
        lambda: nlp_gait.solve(problem, x0=given[0]),
    ):
        with pytest.raises(InputError, match="of nao-ssp must be numbers, got"):
            refuse()


def test_numbers_of_every_kind_that_mean_one_are_taken() -> None:
    objective, X = read_objective("nao-ssp"), candidates(problem_named("nao-ssp"), 4)
    unmasked = np.ma.masked_array(X, mask=np.zeros(X.shape))
    exact = [[Fraction(value) for value in row] for row in X.tolist()]
    for given in (unmasked, exact, X.astype(np.longdouble), X.astype(object)):
        assert np.array_equal(objective(given)[0], objective(X)[0])


@pytest.mark.parametrize("compiled", [True, False])
def test_one_point_has_the_values_of_a_batch_of_one(compiled: bool) -> None:
    problem = toy(corner)
    objective = compile_objective(problem, require_compiler=True)
    if not compiled:
        objective = CompiledObjective(problem, InterpretedRows(problem), compile_objective)
    for x in ([0.0, 1.5], [2.5, 0.1], [np.nan, 0.0]):
        f, violation = objective(np.array([x]))
        assert objective.point(np.array(x)) == objective.point(x) == (f[0], violation[0])
    assert objective.point({"x": 0.0, "y": 1.5}) == pytest.approx((2.0, 5.0))
    for wrong in ([1.0], np.ones((1, 2)), np.array([True, False]), ["1", "2"]):
        with pytest.raises(InputError):
            objective.point(wrong)  # type: ignore[arg-type]


ONE = "erf asinh acosh atanh sign floor ceil fabs log1p expm1 tan asin acos sinh cosh tanh sqrt exp log sin cos atan logic_not"
TWO = "fmod remainder copysign atan2 hypot fmin fmax logic_and logic_or lt le eq ne power plus minus times rdivide"


@pytest.mark.parametrize("lanes", sorted({1, LANES[-1]}))
def test_scalar_operations_agree_with_casadi_also_for_nan(lanes: int) -> None:
    x, y = ca.MX.sym("x", 4), ca.MX.sym("y", 4)
    values = ca.vertcat(
        *(getattr(ca, name)(x) for name in ONE.split()), *(getattr(ca, name)(x, y) for name in TWO.split())
    )
    g = ca.vertcat(values, ca.if_else(x[0] < y[0], x[1] ** 2, 1 / y[1]))
    problem = nlp_gait.problem({"x": ca.veccat(x, y), "f": x[0], "g": g}, lbx=-2, ubx=2, lbg=-9)
    objective = compile_objective(problem, require_compiler=True, lanes=lanes)
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (21, 8))
    points[3, :4], points[4, 4:], points[5, :4] = 0.0, points[4, :4], np.inf
    expected = ca.Function("rows", [x, y], [g])(points[:, :4].T, points[:, 4:].T).full().T
    np.testing.assert_allclose(objective.constraints(points)[:, :-8], expected, rtol=1e-12, atol=1e-12)
