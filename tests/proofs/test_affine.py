"""Affine arithmetic encloses every value: single operations against exact ones, problems at sampled points."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.backends.kernel.kernel_source import build_kernel
from nlp_gait.errors import InputError
from nlp_gait.proofs.affine import AffineFunction
from tests.proofs.enclosed_operations import AFFINE, QUADRATIC, find_lost_values

SEED = 7
EACH = 50  # points of each operation
POINTS = 200
# Of values as computed in double precision, relative: they err themselves.
ROUNDING = 1e-9


@pytest.mark.parametrize(
    "quadratic", [pytest.param(False, id="affine"), pytest.param(True, id="quadratic", marks=pytest.mark.slow)]
)
def test_every_operation_encloses_exact_values_at_random_points(quadratic: bool) -> None:
    rng = np.random.default_rng(SEED)
    for name in QUADRATIC if quadratic else AFFINE:
        assert not list(find_lost_values(name, EACH, rng, quadratic=quadratic))


@pytest.mark.parametrize("name", [pytest.param("walk12", marks=pytest.mark.slow), "nao-dsp"])
def test_problems_hold_every_value_at_sampled_points_of_random_boxes(name: str) -> None:
    problem = nlp_gait.load(name, intervals=2)
    kernel, rng = build_kernel(problem), np.random.default_rng(SEED)
    function, n = AffineFunction(kernel.function), len(problem.names)
    symbols = np.r_[np.arange(n), np.full(len(problem.p), -1)]
    finite = 0
    for width in (0.5, 0.1, 0.01, 1e-3, 1e-6):
        middle, half = rng.uniform(problem.lower, problem.upper), width * problem.scale / 2
        box = np.stack([np.maximum(problem.lower, middle - half), np.minimum(problem.upper, middle + half)], -1)
        forms = function(np.concatenate([box, np.stack([problem.p] * 2, -1)])[None], symbols)
        X = rng.uniform(box[:, 0], box[:, 1], (POINTS, n))
        values = np.vstack([part.full() for part in kernel.function.map(POINTS)(X.T, problem.p)]).T
        slack = ROUNDING * (1 + np.abs(values))
        assert np.all((forms.lower <= values + slack) & (values - slack <= forms.upper))
        share = (X - box.mean(axis=-1)) / (np.ptp(box, axis=-1) / 2)
        known = np.isfinite(forms.error[0])
        finite += int(known.sum())
        off = np.abs(forms.middle + share @ forms.slopes[0].T - values)
        assert np.all((off <= forms.error + slack)[:, known])
    assert finite > function.outputs  # most boxes have forms


def test_slopes_cancel_what_intervals_count_twice() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [ca.vertcat(x - x, x * x - 2 * x * x + x**2)]))
    forms = function(np.array([[[1.0, 2.0]]]), np.array([0]))
    assert forms.slopes.shape == (1, 2, 1)
    np.testing.assert_allclose(forms.lower[0, 0], 0.0, atol=1e-14)
    assert forms.upper[0, 1] - forms.lower[0, 1] < 1.1  # intervals give a width of 9


def test_two_inputs_with_one_symbol_vary_together() -> None:
    x = SX.sym("x", 2)
    function = AffineFunction(ca.Function("f", [x], [x[1] - x[0]]))
    box = np.array([[[0.0, 1.0], [0.5, 1.5]]])
    together, apart = (function(box, np.array(symbols)) for symbols in ([0, 0], [0, 1]))
    np.testing.assert_allclose([together.lower[0, 0], together.upper[0, 0]], 0.5, atol=1e-14)
    np.testing.assert_allclose([apart.lower[0, 0], apart.upper[0, 0]], [-0.5, 1.5], atol=1e-14)


def test_a_half_open_input_does_not_reach_its_upper_end() -> None:
    x = SX.sym("x")
    jump = ca.Function("f", [x], [SX(0.5 <= x)])  # noqa: SIM300  as splines ask
    box, symbols = np.array([[[0.0, 0.5]], [[0.5, 1.0]]]), np.array([0])
    forms = AffineFunction(jump, half_open=[0])(box, symbols)
    np.testing.assert_array_equal(forms.lower[:, 0], [0.0, 1.0])
    np.testing.assert_array_equal(forms.upper[:, 0], [0.0, 1.0])
    assert AffineFunction(jump)(box, symbols).upper[0, 0] == 1.0


def test_what_is_undefined_on_part_of_a_box_is_the_whole_line() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [ca.vertcat(1 / x, ca.sqrt(x), ca.log(x), x / (x + x**3))]))
    forms = function(np.array([[[-1.0, 1.0]]]), np.array([0]))
    assert np.all(np.isinf(forms.lower)) and np.all(np.isinf(forms.upper)) and np.all(np.isinf(forms.error))


def test_boxes_of_the_wrong_shape_and_unknown_operations_are_refused() -> None:
    x = SX.sym("x")
    function = AffineFunction(ca.Function("f", [x], [x + 1]))
    with pytest.raises(InputError, match="boxes and symbols of 1 inputs"):
        function(np.zeros((1, 2, 2)), np.array([0]))
    with pytest.raises(InputError, match="cannot be enclosed"):
        AffineFunction(ca.Function("f", [x], [ca.erf(x)]))
