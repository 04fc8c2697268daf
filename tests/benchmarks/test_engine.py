"""Tables about the engine, on a few gaits."""

import pytest

pytest.importorskip("mujoco")

from benchmarks.engine import agreement  # noqa: E402


def test_the_engine_ranks_random_gaits_of_double_support_as_the_model_does(monkeypatch):
    monkeypatch.setattr(agreement, "RANDOM", 3)
    monkeypatch.setattr(agreement, "RANKED", {"feed-forward": agreement.RANKED["feed-forward"]})
    monkeypatch.setattr(agreement, "KINDS", {"nao-dsp": {}})
    row = list(agreement.ranking())[-1].split(" | ")
    assert row[2:5] == ["0", "0", "1.0000"]
    assert abs(float(row[6].rstrip("%"))) < 5.0
