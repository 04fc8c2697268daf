"""The reproduction on stairs tells how many steps it has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from compare.papers.stairs import reproduce as stairs
from nlp_gait.problems.stairs.track import PARAMETERS, PLAN


class Told:
    """In place of ``Steps``: tells of each step, computes none, and gives the same plan as the result of all."""

    def __init__(self, _: Path, progress: Callable[[str], None], code: object) -> None:
        self._progress = progress

    def __call__(self, name: str, inputs: dict[str, Any], compute: Callable[[], Any]) -> dict[str, Any]:
        self._progress(name)
        known = {parameter.name: parameter.default for parameter in PARAMETERS if parameter.name in PLAN}
        return {"x": {**known, "torso_pitch_rad": 1.4}, "objective": 1.0, "feasible": True}


def test_progress_is_told_as_often_as_promised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("write_figures", "write_report"):
        monkeypatch.setattr(stairs, name, lambda *args: None)
    monkeypatch.setattr(stairs, "Steps", Told)
    told: list[str] = []
    stairs.reproduce(tmp_path, progress=told.append)
    assert len(told) == len(set(told)) == stairs.STEPS
