"""Tables about the engine, on a few gaits."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

import nlp_gait  # noqa: E402
from benchmarks.engine import agreement, gaits  # noqa: E402
from compare.judge import evaluate  # noqa: E402


def test_random_gaits_are_feasible_and_seeded():
    problem = nlp_gait.load("nao-dsp")
    found = gaits.random_gaits(problem, 3, seed=3)
    assert [evaluate(problem, gait.x).feasible for gait in found] == [True] * 3
    again = gaits.random_gaits(problem, 3, seed=3)
    np.testing.assert_array_equal([gait.x for gait in found], [gait.x for gait in again])


def test_the_engine_ranks_random_gaits_of_double_support_as_the_model_does(monkeypatch):
    monkeypatch.setattr(agreement, "RANDOM", 3)
    monkeypatch.setattr(agreement, "RANKED", {"feed-forward": agreement.RANKED["feed-forward"]})
    monkeypatch.setattr(agreement, "KINDS", {"nao-dsp": {}})
    row = list(agreement.ranking())[-1].split(" | ")
    assert row[2:5] == ["0", "0", "1.0000"]
    assert abs(float(row[6].rstrip("%"))) < 5.0
