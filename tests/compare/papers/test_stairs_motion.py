"""Drawn steps on stairs: feet stand where they should, legs keep their lengths, nothing jumps."""

from __future__ import annotations

import numpy as np
import pytest

from compare.papers.stairs.stairs_motion import Leg, first_step, swing_leg, two_steps
from nlp_gait.gaits.stairs.track import PARAMETERS, PLAN

TREAD, RISE = 0.254, 0.1778
PLANNED = {"torso_pitch_rad": 1.45, **{parameter.name: parameter.default for parameter in PARAMETERS}}


@pytest.fixture(scope="module")
def legs() -> tuple[Leg, Leg]:
    return two_steps(PLANNED, TREAD, RISE, np.linspace(0.0, 3.5 + PLAN["t2_s"], 857))


def test_the_swing_foot_ends_flat_two_steps_on(legs: tuple[Leg, Leg]) -> None:
    swing, _ = legs
    assert swing.ankle[0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert swing.ankle[-1] == pytest.approx([2 * TREAD, 2 * RISE], abs=1e-6)
    assert swing.toe[-1] - swing.ankle[-1] == pytest.approx([0.17, 0.0], abs=1e-6)


def test_the_other_foot_stands_and_then_rises_about_its_toe(legs: tuple[Leg, Leg]) -> None:
    _, other = legs
    stands = np.linspace(0.0, 3.5 + PLAN["t2_s"], 857) < 3.5
    assert np.ptp(other.ankle[stands], axis=0).max() == 0.0
    assert np.ptp(other.toe, axis=0).max() < 1e-9
    assert other.ankle[-1, 1] > RISE + 0.02


def test_legs_keep_their_lengths_and_nothing_jumps(legs: tuple[Leg, Leg]) -> None:
    for leg in legs:
        lengths = np.linalg.norm(np.diff(leg.lines, axis=1), axis=2)
        assert lengths == pytest.approx(np.tile([0.4, 0.4, 0.12, 0.05], (len(lengths), 1)), abs=1e-9)
        assert np.abs(np.diff(leg.lines, axis=0)).max() < 0.02


def test_first_step_goes_up_one_step_from_standing() -> None:
    swing, stance = first_step(PLANNED, TREAD, RISE, np.linspace(0.0, 3.5, 50))
    assert swing.ankle[0] == pytest.approx(stance.ankle[0], abs=1e-9)
    assert swing.toe[-1, 1] == pytest.approx(RISE, abs=1e-9)
    assert np.ptp(stance.hip[:, 1]) == 0.0


def test_angles_and_vectors_of_the_swing_leg_agree() -> None:
    angles, vectors = swing_leg(PLANNED, TREAD, RISE, np.linspace(0.0, 3.5, 30))
    reached = 0.4 * np.column_stack([np.cos(angles).sum(axis=1), -np.sin(angles).sum(axis=1)])
    assert reached == pytest.approx(vectors, abs=1e-12)
