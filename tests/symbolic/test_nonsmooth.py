"""The Exact and the Lifted interpretation of what is not smooth."""

import casadi as ca
import numpy as np
import pytest
from casadi import MX, SX
from hypothesis import given
from hypothesis import strategies as st

from nlp_gait.formulation import Array
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact, Lifted, Nonsmooth, Root

MARGIN = 0.01
reals = st.floats(-1e6, 1e6)


def value(expression: MX) -> Array:
    return np.array(ca.evalf(expression)).ravel()


def acos(ops: Nonsmooth, margin: float = MARGIN) -> ca.Function:
    argument = SX.sym("c")
    return ca.Function("acos", [argument], list(ops.acos(argument, SX(margin))))


@given(v=reals, a=reals, b=reals)
def test_exact_operations_are_numpys(v: float, a: float, b: float) -> None:
    ops = Exact()
    assert value(ops.abs(MX(v)))[0] == abs(v)
    assert value(ops.min(MX(a), MX(b)))[0] == min(a, b)
    assert value(ops.step(MX(v), MX(1.0), MX(2.0)))[0] == (2.0 if v >= 0 else 1.0)


@given(v=st.tuples(reals, reals), w=st.tuples(reals, reals))
def test_a_lift_starts_at_the_exact_value_where_its_rows_hold_and_one_is_tight(
    v: tuple[float, float], w: tuple[float, float]
) -> None:
    ops, exact = Lifted(MX(1e-3)), Exact()
    ops.abs(MX(ca.DM(v)))
    ops.min(MX(ca.DM(v)), MX(ca.DM(w)))
    expected = [value(exact.abs(MX(ca.DM(v)))), value(exact.min(MX(ca.DM(v)), MX(ca.DM(w))))]
    for lift, exactly in zip(ops.lifts, expected, strict=True):
        rows = ca.Function("rows", [lift.variable], [lift.rows])
        np.testing.assert_array_equal(value(lift.value), exactly)
        np.testing.assert_array_equal(np.array(rows(exactly)).reshape(2, 2).min(axis=0), 0.0)
        # The other way round: a step away from the exact value on the wrong side violates a row.
        wrong = exactly + (-1.0 if lift.from_above else 1.0)
        assert (np.array(rows(wrong)) < 0.0).any()


def test_a_lifted_step_is_a_sigmoid_that_becomes_the_jump() -> None:
    for width, tolerance in ((1e-2, 0.2), (1e-4, 1e-12)):
        ops = Lifted(MX(width))
        for switch, expected in ((-0.02, 0.05), (0.02, 0.10)):
            assert value(ops.step(MX(switch), MX(0.05), MX(0.10)))[0] == pytest.approx(expected, abs=tolerance * 0.05)
        assert value(ops.step(MX(0.0), MX(0.05), MX(0.10)))[0] == pytest.approx(0.075)
        assert ops.smoothed
    assert not Lifted(MX(1.0)).smoothed


@pytest.mark.parametrize("ops", [Exact(), Lifted(MX(1e-3))], ids=["exact", "lifted"])
def test_within_the_margin_acos_and_its_derivatives_are_exact(ops: Nonsmooth) -> None:
    for c in np.linspace(-1 + MARGIN, 1 - MARGIN, 21):
        got = [float(v) for v in acos(ops)(c)]
        sine = np.sqrt(1 - c * c)
        assert got == pytest.approx([np.arccos(c), -1 / sine, -c / sine**3], rel=1e-12, abs=1e-12)


def test_lifted_acos_has_no_jump_in_value_or_slope_where_the_tangent_begins() -> None:
    for limit, margin in ((1 - MARGIN, MARGIN), (1 - LEAST_REACH_MARGIN, 0.0)):
        for sign in (-1.0, 1.0):
            step = 1e-6 * (1 - limit)
            inside, outside = (acos(Lifted(MX(1e-3)), margin)(sign * (limit + s)) for s in (-step, step))
            assert float(inside[0]) == pytest.approx(float(outside[0]), abs=1e-5 * np.sqrt(1 - limit))
            assert float(inside[1]) == pytest.approx(float(outside[1]), rel=1e-5)


def test_exact_acos_clamps_and_lifted_acos_continues_along_the_tangent() -> None:
    assert [float(v) for v in acos(Exact())(1.5)] == [0.0, 0.0, 0.0]
    limit = 1 - MARGIN
    slope = -1 / np.sqrt(1 - limit**2)
    got = [float(v) for v in acos(Lifted(MX(1e-3)))(1.5)]
    assert got == pytest.approx([np.arccos(limit) + slope * (1.5 - limit), slope, 0.0], rel=1e-12)


def test_a_stretched_knee_has_a_steep_and_finite_slope_when_exact() -> None:
    """At +-1 the sine is taken as 1e-8; beyond, the leg is out of reach and still."""
    for c, second in ((1.0, -1e24), (-1.0, 1e24)):
        _, first, bend = (float(v) for v in acos(Exact())(c))
        assert (first, bend) == pytest.approx((-1e8, second))
        assert [float(v) for v in acos(Exact())(c * (1 + 1e-15))[1:]] == [0.0, 0.0]


@given(v=st.lists(reals, min_size=1, max_size=9))
def test_the_largest_of_a_vector_is_found_at_every_place(v: list[float]) -> None:
    column, largest = MX(ca.DM(v)), max(map(abs, v))
    got = value(Exact().largest(column))
    assert got.tolist() == [largest]
    ops = Lifted(MX(1e-3))
    ops.largest(column)
    (lift,) = ops.lifts
    rows = ca.Function("rows", [lift.variable], [lift.rows])
    assert value(lift.value).tolist() == [largest]
    assert lift.rows.shape == (2 * len(v), 1)
    assert np.array(rows(largest)).min() == 0.0
    assert lift.from_above


def recurrence() -> ca.Function:
    """(a, b) to (a + b + u, 2 b + w)."""
    state, u, w = MX.sym("state", 2), MX.sym("u"), MX.sym("w")
    return ca.Function("step", [state, u, w], [ca.vertcat(state[0] + state[1] + u, 2 * state[1] + w)])


def test_a_rollout_by_hand_and_its_equations() -> None:
    """From (1, 1) with u = (0, 10, 0) and w = (0, 0, -1): (2, 2), (14, 4), (18, 7)."""
    initial, inputs = MX(ca.DM([1, 1])), (MX(ca.DM([[0, 10, 0]])), MX(ca.DM([[0, 0, -1]])))
    path = [2.0, 2.0, 14.0, 4.0, 18.0, 7.0]
    assert value(ca.vec(Exact().rollout(recurrence(), initial, *inputs))).tolist() == path
    ops = Lifted(MX(1e-3))
    lifted = ops.rollout(recurrence(), initial, *inputs)
    (lift,) = ops.lifts
    assert lifted.shape == (2, 3)
    assert lift.tight
    assert value(lift.value).tolist() == path
    rows = ca.Function("rows", [lift.variable], [lift.rows])
    assert np.array(rows(path)).ravel().tolist() == [0.0] * 6
    # An error in the second state is seen in its own step and carried into the next one.
    off = np.array(rows(np.array(path) + np.array([0, 0, 1.0, 0, 0, 0]))).ravel().tolist()
    assert off == [0.0, 0.0, 1.0, 0.0, -1.0, 0.0]


def test_a_root_is_newtons_result_or_a_variable_that_an_equation_ties() -> None:
    """x^2 = 2, from 1.5: 1.4142135623730951 after four steps."""

    def newton(inputs: SX) -> SX:
        x = SX(1.5)
        for _ in range(4):
            x = x - (x**2 - inputs) / (2 * x)
        return x

    root = Root(residual=lambda x, inputs: x**2 - inputs, newton=newton, lift=True)
    number = SX.sym("number")
    assert float(ca.Function("f", [number], [Exact().root(root, number)])(2.0)) == pytest.approx(2.0**0.5, abs=1e-15)
    assert Exact().collect_implicit_variables() is None
    ops = Lifted(MX(1e-3))
    unknown = ops.root(root, number)
    opened = ops.collect_implicit_variables()
    assert opened is not None and ops.collect_implicit_variables() is None
    assert unknown.is_symbolic() and float(ca.Function("s", [number], [opened.start])(2.0)) == pytest.approx(2.0**0.5)
    instant = ca.Function("instant", [opened.unknowns, number], [opened.residual])
    numbers = ca.DM([[2.0, 3.0]])
    solved = ops.add_implicit_variables(MX(ca.DM([[1.4, 1.7]])), lambda x: instant.map(2)(x, numbers))
    assert solved.shape == (1, 2)
    (lift,) = ops.lifts
    assert lift.tight
    rows = ca.Function("rows", [lift.variable], [lift.rows])
    np.testing.assert_allclose(np.array(rows([2.0**0.5, 3.0**0.5])), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.array(rows([2.0, 2.0])).ravel(), [2.0, 1.0])
    unlifted = Root(residual=root.residual, newton=newton, lift=False)
    assert not ops.root(unlifted, number).is_symbolic() and ops.collect_implicit_variables() is None
