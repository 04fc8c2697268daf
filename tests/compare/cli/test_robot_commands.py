"""``simulate`` and ``export`` as scripts use them."""

import json
import sys

import numpy as np
import pytest

from tests.compare.cli.calls import nlp_gait, one_sentence
from tests.compare.records import DSP_X

X = {**DSP_X, "double_support_time_s": 2}  # slow enough for another robot


@pytest.fixture
def gait(tmp_path):
    path = tmp_path / "gait.json"
    path.write_text(json.dumps({"problem": "nao-dsp", "x": X}))
    return path


def test_simulate_reports_and_writes_its_folder(gait, tmp_path):
    pytest.importorskip("mujoco")
    out = tmp_path / "out"
    report = json.loads(nlp_gait("simulate", gait, "--out", out, "--json").stdout)
    assert report["fallen"] is False and report["measured"]["mechanical_W"] > 0.0
    assert {**json.loads((out / "report.json").read_text()), "files": report["files"]} == report
    written = sorted(p.name for p in out.iterdir())
    assert written == ["model.xml", "report.json", "simulation.npz", "simulation.png"]
    with np.load(out / "simulation.npz") as arrays:
        assert arrays["q"].shape == (len(arrays["t"]), 22) == arrays["set_points"].shape


def test_simulate_without_the_extra_refuses_in_one_sentence(gait, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert "pip install 'nlp-gait[sim]'" in one_sentence("simulate", gait)


def test_a_drive_is_read_from_a_file(gait, tmp_path):
    pytest.importorskip("mujoco")
    drive = tmp_path / "drive.toml"
    drive.write_text('period_s = 0.02\ninterpolation = "held"\n')
    (held, default) = (
        json.loads(nlp_gait("simulate", gait, *more, "--json").stdout) for more in (("--drive", drive), ())
    )
    assert held["measured"]["mechanical_W"] != default["measured"]["mechanical_W"]


def test_a_page_plays_the_simulation(gait, tmp_path):
    pytest.importorskip("mujoco")
    page = tmp_path / "walk.html"
    assert f"wrote {page}" in nlp_gait("simulate", gait, "--page", page).stdout.replace("\n", "")
    text = page.read_text()
    assert '{"gaits": [{' in text
    assert "engine" in text and "<canvas" not in text  # its script makes the canvas


def test_export_writes_next_to_the_result_by_default(gait):
    assert "gait.motion" in nlp_gait("export", gait, "--to", "webots").stdout
    assert gait.with_name("gait.motion").read_text().startswith("#WEBOTS_MOTION,V1.0,LHipYawPitch,")


def test_export_writes_a_page(gait):
    gait.write_text(json.dumps({"problem": "nao-dsp", "x": {**X, "double_support_time_s": 0.3}}))
    for force in ([], ["--force"]):
        nlp_gait("export", gait, "--to", "html", *force)
    assert ">right leg</text>" in gait.with_suffix(".html").read_text()
