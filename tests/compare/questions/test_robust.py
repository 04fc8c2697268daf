"""Robust optima and the command ``robust``."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.questions import robust as question
from compare.questions.robust_gait import make_boxes
from nlp_gait import load
from nlp_gait.backends.exact import build_exact_model

pytestmark = pytest.mark.usefixtures("coarse_pictures")

RUN = CliRunner()


def test_the_command_finds_a_gait_for_every_sole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(question, "make_boxes", lambda *args: {"soles": make_boxes(*args)["soles"]})
    done = RUN.invoke(app, ["robust", "nao-ssp", "--starts", "1", "--out", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    (found,) = answer["boxes"]
    assert found["settled"]
    # The mean lateral margin counts to the sole's edge: a sole that may be 2 mm off takes these 2 mm.
    assert found["nominal_worst"]["row"] == "dbm_y_mean"
    assert found["nominal_worst"]["violation"] == pytest.approx(0.002, abs=1e-6)
    assert found["worst"]["violation"] == found["random_worst"]["violation"] == 0.0
    # It costs what its price says, and a little more where the price grows.
    price = 23.7325
    assert found["power_W"] - found["nominal_W"] == pytest.approx(0.002 * price, rel=0.01)
    written = [Path(name) for name in answer["files"]]
    assert [row["name"] for row in csv.DictReader((tmp_path / "nao-ssp-robust.csv").read_text().splitlines())] == [
        "soles"
    ]
    assert {path.suffix for path in written} == {".html", ".md", ".csv", ".png", ".svg", ".json"}
    assert all(path.stat().st_size > 0 for path in written)
    # Solved independently: the nominal problem with a limit that is 2 mm stricter has the same optimum.
    x = np.array(list(found["x"].values()))
    stricter = load("nao-ssp").with_values(dbm_y_mean_limit_m=0.022)
    at = build_exact_model(stricter).at(x, stricter.p)
    assert at.violation < 1e-6
    assert at.cost == pytest.approx(found["power_W"])


def test_boxes_grow_and_name_every_link() -> None:
    soles, whole, links = make_boxes(load("nao-ssp"), 0.05, 0.002).values()
    assert set(soles) < set(whole) and set(soles) < set(links)
    assert links["LThigh.mass"] == 0.05 and whole["mass"] == 0.05 and soles["sole_y_m"] == 0.002


def test_problems_without_a_robot_are_refused(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["robust", "walk12", "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert done.stderr.startswith("nlp-gait: problem 'walk12' has no robot that could be uncertain")
