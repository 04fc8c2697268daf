"""Stick figures of all problems."""

import numpy as np
import pytest

import nlp_gait
from nlp_gait.formulation import Result, sample_signals

SSP = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)


def drawn(name, x=None, frames_per_s=2.5, **options):
    problem = nlp_gait.load(name, **options)
    point = problem.start_point(np.random.default_rng(0)) if x is None else problem.check_x(x)
    assert problem.display.skeleton is not None
    return problem.display.skeleton(
        sample_signals(Result(problem=problem, x=point), 1.0 / frames_per_s), problem.parameter_values
    )


@pytest.fixture(scope="module")
def nao():
    return drawn("nao-ssp", SSP)


def test_nao_has_its_lengths_and_stands_on_its_soles(nao):
    left = next(limb for limb in nao.limbs if limb.side == "left").points
    lengths = np.linalg.norm(np.diff(left, axis=1), axis=2)
    np.testing.assert_allclose(lengths[:, 1:], [[0.1, 0.1029, 0.04519]] * len(nao.t), atol=1e-9)
    np.testing.assert_allclose(left[:, -1], [[0.06, 0.05, 0.0]] * len(nao.t), atol=1e-9)
    assert [sole.supports.tolist() for sole in nao.soles] == [[True] * 11, [True] + [False] * 9 + [True]]


def test_the_drawn_stair_climber_is_where_its_planner_puts_it():
    problem = nlp_gait.load("stairs-plan")
    x = problem.start_point(np.random.default_rng(0))
    arrays = problem.signals(x).arrays
    swing = next(limb for limb in drawn("stairs-plan", frames_per_s=0.01).limbs if limb.side == "right").points
    np.testing.assert_allclose(swing[:, 0][:, [0, 2]], arrays["hip"], atol=1e-9)
    in_reach = np.abs(arrays["reach"]).max(axis=1) < 0.99  # beyond it the planner's leg does not meet its ankle
    assert in_reach.sum() > 30
    np.testing.assert_allclose(swing[in_reach, 2][:, [0, 2]], arrays["ankle"][in_reach], atol=1e-9)


def test_stairs_are_drawn_under_the_feet():
    stairs = drawn("stairs-plan")
    assert stairs.planar
    rises = np.unique(stairs.ground[:, 1])
    assert len(rises) == 3 and rises[1] == 0.0 and rises[2] == pytest.approx(-rises[0])
    stance = next(limb for limb in stairs.limbs if limb.side == "left").points
    np.testing.assert_allclose(stance[:, 2:, 2], 0.0, atol=1e-12)
