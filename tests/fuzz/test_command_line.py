"""Command lines that once ended in a traceback, a hang, or an answer to another question are refused in one sentence."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from tests.compare.records import DSP_X

SEEDS = Path(__file__).with_name("seeds")
KEPT = (
    ("report", "9" * 400),
    ("report", "absent", "--weights", "nan,1"),
    ("compare", "nao-dsp", "--runs", "1000000000000", "--evaluations", "60"),
    ("solve", "nao-ssp", "--set", "intervals=1000000000"),
    ("evaluate", "nao-dsp", "--x", "1", "--set", "self=1"),
    ("sweep", "walk12", "--over", "lambda=0:1:1000000000"),
    ("export", "pipe.json", "--to", "csv"),
    ("export", "result.json", "--to", "csv", "--out", "pipe.json"),
    ("evaluate", "nao-dsp", "--x", "\ud800"),
    ("export", "result.json", "--to", "csv", "--period-ms", "9" * 400),
    ("export", "result.json", "--to", "csv", "--out", "x" * 300),
    ("evaluate", "nao-dsp", "--x", "1", "--robot", "x" * 300 + ".urdf"),
    ("certainty", "walk12", "--check", "certificate.json"),
    ("simulate", "step.json", "--steps", "1000000000"),
    ("simulate", "step.json", "--push", "1e999,0"),
    ("simulate", "step.json", "--push", "0,0,-1,2"),
    ("variants", "--starts", "1000000000"),
    ("prices", "walk12", "--starts", "1000000000"),
    ("pareto", "nao-ssp", "--points", "1000000000"),
    ("certainty", "walk12", "--starts", "1000000000"),
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, seed in (("result", "result/by-hand.json"), ("certificate", "certificate/closed.json")):
        Path(f"{name}.json").write_bytes((SEEDS / seed).read_bytes())
    Path("step.json").write_text(json.dumps({"problem": "nao-dsp", "x": DSP_X}))
    os.mkfifo("pipe.json")


@pytest.mark.parametrize("line", KEPT, ids=lambda line: " ".join(line)[:60].encode("ascii", "replace").decode())
def test_lines_that_once_did_harm(line: tuple[str, ...]) -> None:
    done = CliRunner().invoke(app, line)
    assert done.exit_code in (1, 2) and isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == 2 or done.stderr.splitlines()[-1].startswith("nlp-gait: ")
