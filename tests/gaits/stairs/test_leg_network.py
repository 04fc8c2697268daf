"""The paper's network learns every pose of a step; at the printed rate it does not."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.leg_network import (
    ONLINE,
    PRINTED,
    NetworkSettings,
    compute_leg_rates,
    compute_leg_vector,
    make_training_path,
)

THIGH = SHANK = 0.4
# A millimetre at the ankle, on a knee bent by at least 0.5 rad.
ANGLE_TOLERANCE = 6e-3


@pytest.fixture
def path() -> tuple[Array, Array]:
    """Angles (351, 2) of a swinging leg and where its ankle is."""
    t = np.linspace(0.0, 1.0, 351)
    hip = 1.6 - 0.9 * np.sin(np.pi * t) ** 2
    knee = 0.5 + 1.0 * np.sin(np.pi * t)
    both = hip + knee
    ankle = np.column_stack([np.cos(hip) + np.cos(both), -np.sin(hip) - np.sin(both)]) * THIGH
    return np.column_stack([hip, both]), ankle


def train(ankle: Array, settings: NetworkSettings) -> tuple[Array, Array, Array]:
    """Angles (m, 2), squared errors (m,) and numbers of steps (m,)."""
    train_path = make_training_path(settings, THIGH, SHANK, len(ankle))
    angles, errors, steps = (np.array(part) for part in train_path(settings.first_weights, ankle.T))
    return angles.T, errors[0], steps[0]


def test_every_pose_is_learned_at_the_rate_in_the_loop(path: tuple[Array, Array]) -> None:
    angles, ankle = path
    reached, errors, steps = train(ankle, replace(ONLINE, iterations=1000))
    assert (errors <= ONLINE.tolerance_m2).all()
    assert np.abs(reached - angles).max() < ANGLE_TOLERANCE
    assert steps[0] > steps[1:].mean()  # the first pose takes longest


def test_the_printed_rate_does_not_converge(path: tuple[Array, Array]) -> None:
    _, errors, steps = train(path[1][:5], replace(PRINTED, iterations=500))
    assert (errors > 1e-6).sum() >= 4 and (steps == 500).sum() >= 4


def test_rates_of_the_leg_move_its_ankle_as_requested() -> None:
    angles, velocity = SX.sym("angles", 2), SX.sym("velocity", 2)
    rates = compute_leg_rates(angles, velocity, THIGH, 1.2 * SHANK)
    moved = ca.jtimes(compute_leg_vector(angles, THIGH, 1.2 * SHANK), angles, rates)
    at = ca.Function("moved", [angles, velocity], [moved, rates])
    assert at([1.2, 2.0], [0.3, -0.7])[0].full().ravel() == pytest.approx([0.3, -0.7], rel=1e-5)
    assert np.isfinite(at([1.2, 1.2], [0.3, -0.7])[1].full()).all()  # a straight knee
