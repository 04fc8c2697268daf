"""Compiled functions: CasADi's numbers at each lane count, for any shapes, and one sentence for what cannot be compiled."""

import pickle
import re

import casadi as ca
import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.kernel import compiled_function
from nlp_gait.backends.kernel.compiler import native_lanes
from nlp_gait.errors import GaitError, InputError, UnknownNameError
from nlp_gait.formulation import Array

TOLERANCE = 1e-12
X, Y = ca.SX.sym("x", 4), ca.SX.sym("y", 4)
ONE = "erf asinh acosh atanh sign floor ceil fabs log1p expm1 tan asin acos sinh cosh tanh sqrt exp log sin cos atan logic_not"
TWO = "fmod remainder copysign atan2 hypot fmin fmax logic_and logic_or lt le eq ne power plus minus times rdivide"
SCALAR = ca.Function(
    "scalar",
    [X, Y],
    [ca.vertcat(*(getattr(ca, name)(X) for name in ONE.split()), *(getattr(ca, name)(X, Y) for name in TWO.split())),
     ca.if_else(X[0] < Y[0], X[1] ** 2, 1 / Y[1])],
    ["x", "y"],
    ["vector", "choice"],
)  # fmt: skip


def make_matrices() -> ca.Function:
    """MX with a loop over samples, products, norms, a matrix argument and matrix results."""
    x, A, s = ca.MX.sym("x", 2), ca.MX.sym("A", 3, 2), ca.MX.sym("s")
    z = ca.SX.sym("z", 2)
    wave = ca.Function("wave", [z], [ca.sin(z) * z[0]]).map(3)
    B = wave(ca.horzcat(x, 2 * x, 3 * x)) @ ca.if_else(A > 0, A, ca.if_else(s > 0, 2 * A, A)) * s
    return ca.Function("matrices", [x, A, s], [B, ca.norm_2(A @ x), ca.diag(x), ca.if_else(s > 0, x, -x, True)])


def evaluate(function: ca.Function, *columns: Array) -> list[Array]:
    """Results of CasADi's virtual machine, row by row; empty axes of length one are removed."""
    rows = [
        [np.squeeze(ca.DM(v).full()) for v in function.call([ca.DM(c) for c in row])]
        for row in zip(*columns, strict=True)
    ]
    return [np.array(values) for values in zip(*rows, strict=True)]


@pytest.mark.parametrize("lanes", sorted({1, native_lanes()}))
def test_scalar_operations_agree_with_casadi_also_for_nan(lanes: int) -> None:
    compiled = nlp_gait.compile_function(SCALAR, lanes=lanes, threads=1)
    x, y = np.random.default_rng(0).uniform(-2.0, 2.0, (2, 21, 4))
    x[3], y[4], x[5] = 0.0, x[4], np.inf
    for found, expected in zip(compiled(x, y), evaluate(SCALAR, x, y), strict=True):
        np.testing.assert_allclose(found, expected, rtol=TOLERANCE, atol=TOLERANCE)


@pytest.mark.parametrize("most_expanded", [0, 5000])
def test_matrices_and_loops_and_arguments_for_all_rows(most_expanded: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_function, "MOST_EXPANDED", most_expanded)
    function, rng = make_matrices(), np.random.default_rng(1)
    compiled = nlp_gait.compile_function(function, threads=1)
    x, A, s = rng.normal(size=(11, 2)), rng.normal(size=(3, 2)), rng.normal(size=11)
    found = compiled(x, A, s)
    assert [result.shape for result in found] == [(11, 2, 2), (11,), (11, 2, 2), (11, 2)]
    for result, expected in zip(found, evaluate(function, x, np.repeat(A[None], 11, axis=0), s), strict=True):
        np.testing.assert_allclose(result, expected, rtol=TOLERANCE, atol=TOLERANCE)
    single = compiled(x[0], A, s[0])  # without a number of rows: the shapes of one evaluation
    assert all(np.array_equal(one, many[0]) for one, many in zip(single, found, strict=True))
    assert compiled(np.empty((0, 2)), A, 1.0)[0].shape == (0, 2, 2)


def test_batch_size_threads_and_pickling_change_no_bit() -> None:
    compiled = nlp_gait.compile_function(make_matrices(), threads=3)
    rng = np.random.default_rng(2)
    arguments = rng.normal(size=(20_000, 2)), rng.normal(size=(20_000, 3, 2)), rng.normal(size=20_000)
    first = compiled(*arguments)  # one thread, which measures the time of a row
    again = pickle.loads(pickle.dumps(compiled))
    for others in (compiled(*arguments), again(*arguments)):
        assert all(map(np.array_equal, first, others))
    part = compiled(*(values[:13] for values in arguments))
    assert all(np.array_equal(few, many[:13]) for few, many in zip(part, first, strict=True))


def test_derivatives_are_compiled_functions() -> None:
    x, p = ca.MX.sym("x", 3), ca.MX.sym("p")
    function = ca.Function("f", [x, p], [p * ca.sumsqr(ca.sin(x)), x * p], ["x", "p"], ["cost", "rows"])
    compiled, rng = nlp_gait.compile_function(function), np.random.default_rng(3)
    points, factors = rng.normal(size=(9, 3)), rng.normal(size=9)
    gradient = compiled.jacobian("cost", "x")
    np.testing.assert_allclose(gradient(points, factors), factors[:, None] * np.sin(2 * points), rtol=1e-12)
    assert gradient.result_names == ("cost_by_x",)
    np.testing.assert_allclose(compiled.jacobian(1)(points, factors), factors[:, None, None] * np.eye(3), rtol=1e-12)
    with pytest.raises(UnknownNameError, match="unknown argument 'q'"):
        compiled.jacobian("cost", "q")


def test_wrong_calls_are_one_sentence() -> None:
    compiled = nlp_gait.compile_function(SCALAR, threads=1)
    x = np.zeros((5, 4))
    for arguments, message in (
        ((x,), "scalar has the arguments x, y; got 1"),
        ((x, x[:, :3]), r"argument y of scalar must have the shape \(P, 4\), or \(4,\) for all rows, got \(5, 3\)"),
        ((x, x[:3]), r"the arguments of scalar must have equally many rows, got \[3, 5\]"),
        ((x, "a"), "argument y of scalar must be numbers"),
        ((x, x[None]), "argument y of scalar must have the shape"),
    ):
        with pytest.raises(InputError, match=message):
            compiled(*arguments)


M = ca.MX.sym("m", 4)
SQUARE = ca.reshape(M, 2, 2)
TABLE = ca.interpolant("table", "linear", [[0, 1, 2]], [3, 4, 5])


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            ca.Function("f", [M], [ca.solve(SQUARE, M[:2])]),
            "f cannot be compiled: the operation solve is not supported",
        ),
        (ca.Function("f", [M], [M[ca.floor(M[0])]]), "the operation getnonzeros_param is not"),
        (ca.Function("f", [M], [M.attachAssert(M[0] > 0, "positive")]), "the operation assertion is not"),
        (ca.Function("f", [M], [TABLE(M[0])]), r"the function table \(LinearInterpolant\) is not supported"),
        (ca.Function("f", [X], [ca.erfinv(X)]), "the operation erfinv is not"),
        (ca.Function("f", [ca.SX.sym("A", ca.Sparsity.lower(2))], [1]), "argument i0 of f is sparse"),
        (ca.Function("f", [], [1]), "at least one argument"),
        (M, "function must be a casadi.Function"),
    ],
)
def test_what_cannot_be_compiled_is_one_sentence(function: ca.Function, message: str) -> None:
    with pytest.raises(GaitError, match=message) as caught:
        nlp_gait.compile_function(function)
    assert not re.search(r"\n|\.cpp", str(caught.value))
