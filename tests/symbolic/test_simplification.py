"""Rewritten expressions: the same values, fewer of the dear operations."""

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.symbolic.tape import simplify, tabulate_last_input

# A few roundings in double precision.
TOLERANCE = 1e-14
X = SX.sym("x", 3)
A, B, C = ca.vertsplit(X)
ANGLE = ca.atan2(A, B)
EXPRESSIONS = [
    ca.sin(ANGLE),
    ca.cos(-ANGLE),
    ca.sin(-(ANGLE + ca.acos(C))),
    ca.cos(ca.atan2(-A, ca.sqrt(B * B + 1)) - ca.acos(C)),
    ca.sin(A + ANGLE) + ca.cos(A + ANGLE) + ca.sin(-A),
    ca.vertcat(A / B, C / B, ca.sqrt(A * A) / B, A / 3, 1 / B),
    SX(2, 2),
    ca.diag(ca.vertcat(A, B)) * 2,
]


@pytest.mark.parametrize("seed", range(5))
def test_values_and_shapes_stay(seed: int) -> None:
    x = np.random.default_rng(seed).uniform(-1.0, 1.0, 3)
    rewritten = simplify(EXPRESSIONS)
    for before, after in zip(EXPRESSIONS, rewritten, strict=True):
        assert before.sparsity() == after.sparsity()
        values = [np.array(ca.Function("f", [X], [e])(x)) for e in (before, after)]
        np.testing.assert_allclose(values[1], values[0], rtol=TOLERANCE, atol=TOLERANCE)


def test_a_vector_without_direction_gives_finite_numbers() -> None:
    turned = ca.Function("f", [X], simplify([ca.sin(ANGLE), ca.cos(ANGLE)]))
    assert all(np.isfinite(float(value)) for value in turned([0.0, 0.0, 0.0]))


def test_what_depends_on_the_last_input_alone_is_tabulated() -> None:
    phase = SX.sym("phase")
    function = ca.Function("f", [X, phase], [A * ca.sin(phase) + phase, ca.cos(phase) * C], ["x", "phase"], ["u", "v"])
    values = DM([[0.0, 0.5, 1.0]])
    main, table = tabulate_last_input(function, values)
    assert not {ca.OP_SIN, ca.OP_COS} & {main.instruction_id(k) for k in range(main.n_instructions())}
    assert (main.name_out(), table.shape[1]) == (["u", "v"], 3)
    x = DM([0.1, 0.2, 0.3])
    for k in range(3):
        for got, wanted in zip(main(x, table[:, k]), function(x, values[k]), strict=True):
            assert float(got) == pytest.approx(float(wanted), abs=TOLERANCE)
