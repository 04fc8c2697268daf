"""Walking on with 12 joints: the exchange of legs, straight and in a circle."""

import numpy as np
import pytest

from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps

X = np.array([0.13, 0.109, 0.014, 0.020])
N = 20
EXCHANGED = [11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0]
ROLLS = [JOINTS.index(name) for name in ("theta_1", "theta_6", "theta_7", "theta_12")]


def test_the_second_step_mirrors_the_first() -> None:
    arrays = compute_steps(load_point_mass_biped(), X, intervals=N).arrays
    signs = np.ones(12)
    signs[ROLLS] = -1.0
    for name in ("q", "qd", "qdd"):
        first, second = arrays[name][1 : N + 1], arrays[name][N + 1 :]
        assert second == pytest.approx(first[:, EXCHANGED] * signs, abs=1e-12)
    assert arrays["left_stance"].tolist() == [1.0] * (N + 1) + [0.0] * N
    assert arrays["t"][-1] == 2.0


def test_angles_and_feet_go_on_where_steps_meet() -> None:
    arrays = compute_steps(load_point_mass_biped(), X, steps=3, intervals=2000).arrays
    for name in ("q", "waist", "left_ankle", "right_ankle", "com"):
        assert np.abs(np.diff(arrays[name], axis=0)).max() < 2e-3, name
    assert arrays["left_ankle"][-1] == pytest.approx([X[0], 0.0, 0.0], abs=1e-12)
    assert arrays["right_ankle"][-1] == pytest.approx([1.5 * X[0], -0.12, 0.0], abs=1e-12)


def test_each_step_of_a_circle_turns_by_k() -> None:
    turn, steps = np.radians(7.5), 48
    arrays = compute_steps(load_point_mass_biped(), X, steps=steps + 1, intervals=2, turn_rad=turn).arrays
    assert arrays["q"][:3, JOINTS.index("theta_9")] == pytest.approx(turn)
    assert arrays["q"][3:5, JOINTS.index("theta_4")] == pytest.approx(turn)
    assert not arrays["q"][:3, JOINTS.index("theta_4")].any()
    # 48 steps of 7.5 degrees: the left foot stands again where and as it stood.
    assert arrays["left_ankle"][2 * steps + 1] == pytest.approx(arrays["left_ankle"][1], abs=1e-9)
    span = np.ptp(arrays["waist"][:, 0])
    assert span == pytest.approx(X[0] / turn, rel=0.15)  # diameter of a polygon of chords s / 2
