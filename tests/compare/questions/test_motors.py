"""The command ``motors`` as scripts use it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.questions import real_motors as motors

pytestmark = pytest.mark.usefixtures("coarse_pictures")

RUN = CliRunner()


def test_it_reports_what_each_feature_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("as published", "with speed and torque limits", "with these, K of each motor")
    monkeypatch.setattr(motors, "VARIANTS", {name: motors.VARIANTS[name] for name in names})
    done = RUN.invoke(app, ["motors", "nao-dsp", "--starts", "1", "--out", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    published, limited, heated = answer["variants"]
    assert published["power_W"] == pytest.approx(0.531886, abs=1e-6)
    assert limited["power_W"] == pytest.approx(published["power_W"], rel=1e-6)
    assert limited["unchanged_violation"] == 0.0
    assert heated["power_W"] < heated["unchanged_power_W"]
    assert heated["published_power_W"] > published["power_W"]
    assert 0.0 < published["uses"]["torque against speed"]["share"] < 1.0
    written = [Path(name) for name in answer["files"]]
    assert [
        row["variant"] for row in csv.DictReader((tmp_path / "nao-dsp-motors.csv").read_text().splitlines())
    ] == list(names)
    assert {path.suffix for path in written} == {".html", ".md", ".csv", ".png", ".svg", ".json"}
    assert all(path.stat().st_size > 0 for path in written)


def test_other_problems_have_no_motors(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["motors", "walk12", "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert done.stderr.startswith("nlp-gait: only nao-ssp and nao-dsp")
