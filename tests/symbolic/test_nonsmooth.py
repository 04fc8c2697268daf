"""The Exact and the Lifted interpretation of what is not smooth."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import MX, SX
from hypothesis import given
from hypothesis import strategies as st

from nlp_gait.problems.gait_problem import Array
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact, Lifted, Nonsmooth

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


@pytest.mark.parametrize("ops", [Exact(), Lifted(MX(1e-3))], ids=["exact", "lifted"])
@pytest.mark.parametrize("c", [-1e6, -2.0, -1.0, 1.0, 1.0 + 1e-16, 2.0, 1e6])
@pytest.mark.parametrize("margin", [0.0, MARGIN])
def test_acos_is_finite_everywhere(ops: Nonsmooth, c: float, margin: float) -> None:
    assert np.isfinite([float(v) for v in acos(ops, margin)(c)]).all()


def test_lifted_acos_has_no_jump_in_value_or_slope_where_the_tangent_begins() -> None:
    for limit, margin in ((1 - MARGIN, MARGIN), (1 - LEAST_REACH_MARGIN, 0.0)):
        for sign in (-1.0, 1.0):
            step = 1e-6 * (1 - limit)
            inside, outside = (acos(Lifted(MX(1e-3)), margin)(sign * (limit + s)) for s in (-step, step))
            assert float(inside[0]) == pytest.approx(float(outside[0]), abs=1e-5 * np.sqrt(1 - limit))
            assert float(inside[1]) == pytest.approx(float(outside[1]), rel=1e-5)


def test_exact_acos_clamps_and_lifted_acos_goes_on_along_the_tangent() -> None:
    assert [float(v) for v in acos(Exact())(1.5)] == [0.0, 0.0, 0.0]
    limit = 1 - MARGIN
    slope = -1 / np.sqrt(1 - limit**2)
    got = [float(v) for v in acos(Lifted(MX(1e-3)))(1.5)]
    assert got == pytest.approx([np.arccos(limit) + slope * (1.5 - limit), slope, 0.0], rel=1e-12)
