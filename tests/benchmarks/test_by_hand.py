"""The yardstick of the benchmarks computes what the package computes."""

import numpy as np
import pytest

import nlp_gait

pytest.importorskip("pinocchio")
from benchmarks.by_hand import ByHand  # noqa: E402

# Two programs in double precision.
TOLERANCE = 1e-11


@pytest.mark.usefixtures("without_compiler")
def test_numpy_and_pinocchio_give_the_package_s_values() -> None:
    by_hand = ByHand()
    X = np.random.default_rng(0).uniform(by_hand.lower, by_hand.upper, (10, 9))
    f, violation = by_hand(X)
    expected_f, expected_violation = nlp_gait.compile_objective(by_hand.problem)(X)
    np.testing.assert_allclose(f, expected_f, rtol=TOLERANCE)
    np.testing.assert_allclose(violation, expected_violation, rtol=TOLERANCE, atol=TOLERANCE)
