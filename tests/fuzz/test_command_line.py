"""Mutated command lines end with status 0, 1 or 2 and a sentence."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.fuzz.commands import ended, mutated_line, workplace

LINES = 40
# Each once ended in a traceback, a hang, or an answer to another question.
KEPT = (
    ("report", "9" * 400),
    ("report", "absent", "--gradient-weight", "nan"),
    ("compare", "nao-dsp", "--runs", "1000000000000", "--evaluations", "60"),
    ("solve", "nao-ssp", "--intervals", "1000000000"),
    ("evaluate", "nao-dsp", "--x", "1", "--set", "self=1"),
    ("sweep", "walk12", "--over", "lambda=0:1:1000000000"),
    ("export", "pipe.json", "--format", "csv"),
    ("export", "result.json", "--format", "csv", "--out", "pipe.json"),
    ("evaluate", "nao-dsp", "--x", "\ud800"),
    ("animate", "result.json", "--speed", "inf"),
    ("export", "result.json", "--format", "csv", "--period-ms", "9" * 400),
    ("export", "result.json", "--format", "csv", "--out", "x" * 300),
    ("evaluate", "nao-dsp", "--x", "1", "--robot", "x" * 300 + ".urdf"),
    ("certainty", "walk12", "--check", "certificate.json"),
    ("simulate", "walk.json", "--steps", "1000000000"),
    ("simulate", "walk.json", "--period-ms", "1e-9"),
    ("simulate", "walk.json", "--period-ms", "1e9"),
    ("variants", "--starts", "1000000000"),
    ("prices", "walk12", "--starts", "1000000000"),
    ("robust", "--samples", "1000000000"),
    ("pareto", "nao-ssp", "--points", "1000000000"),
    ("certainty", "walk12", "--starts", "1000000000"),
)


@pytest.mark.parametrize("line", KEPT, ids=lambda line: " ".join(line)[:60].encode("ascii", "replace").decode())
def test_lines_that_once_did_harm(line: tuple[str, ...], tmp_path: Path) -> None:
    with workplace(tmp_path):
        assert ended(line) == "refused"


@pytest.mark.slow
def test_mutated_lines(tmp_path: Path) -> None:
    rng = random.Random(0)
    with workplace(tmp_path):
        for line in [mutated_line(rng) for _ in range(LINES)]:
            assert ended(line) in ("accepted", "refused"), (line, ended(line))
