"""What is wrong with a gait in a file is said before it is simulated or exported."""

import json
from pathlib import Path

import pytest

import nlp_gait
from tests.compare.cli.calls import as_json, one_sentence

# Our optimum of NAO's single support, to the digits that the documentation prints.
OPTIMUM = (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)


def write(path: Path, *, objective: object = None, robot: str = "nao-v5", **changes: float) -> Path:
    x = dict(zip(nlp_gait.load("nao-ssp").names, OPTIMUM, strict=True)) | changes
    result = {"problem": "nao-ssp", "options": {"robot": robot}, "x": x}
    path.write_text(json.dumps(result if objective is None else result | {"objective": objective}))
    return path


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, None),
        ({"objective": 0.8459}, None),
        ({"objective": 0.5}, "The file says power 0.5 W, and it is 0.845884 W"),
        ({"hip_height_m": 9.0}, "violated: bounds[hip_height_m] = 9 m, outside of its bounds 0.25 to 0.31; "),
        ({"hip_height_m": 0.31, "hip_vx_start_m_s": 0.5, "robot": "nao-v4"}, "The gait is not feasible; violated: "),
    ],
)
def test_violations_and_false_objectives_are_named(
    tmp_path: Path, changes: dict[str, float], words: str | None
) -> None:
    faults = as_json("export", write(tmp_path / "gait.json", **changes), "--to", "csv")["faults"]
    assert faults == [] if words is None else words in faults[0]


def test_a_gait_without_an_objective_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "gait.json", objective="0.5")
    assert "objective must be a number, got '0.5'" in one_sentence("export", path, "--to", "csv")
    write(path, hip_height_m=1e308)
    assert "power is nan at this x; bounds[hip_height_m] = 1e+308 m" in one_sentence("export", path, "--to", "csv")


def test_a_time_that_runs_backwards_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "gait.json", single_support_time_s=-0.1)
    assert "must last 0.001 to 300 s, but it lasts -0.1 s" in one_sentence("export", path, "--to", "csv")
    pytest.importorskip("mujoco")
    assert "must last 0.001 to 300 s, but it lasts -0.1 s" in one_sentence("simulate", path)


def test_a_simulation_names_them_too(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    report = as_json("simulate", write(tmp_path / "gait.json", hip_height_m=9.0), "--feedback", "none")
    assert report["fallen"] and "bounds[hip_height_m] = 9 m" in report["faults"][0]
