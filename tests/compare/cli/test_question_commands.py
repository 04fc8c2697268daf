"""`pareto`, `certainty` and `solve` as scripts use them."""

import json
from pathlib import Path

import pytest

from tests.compare.cli.calls import nlp_gait, one_sentence

pytestmark = pytest.mark.usefixtures("coarse_pictures")

# Three free variables, so that both the front and a search of one generation take no time.
SMALL = ["nao-ssp", "--set", "intervals=4", "--starts", "1", "--seed", "0"]
FIXED = {
    "hip_height_m": 0.31,
    "hip_vz_start_m_s": -0.00122,
    "hip_vz_end_m_s": 0.0035,
    "hip_vx_start_m_s": 0.01243,
    "hip_vx_end_m_s": 0.001,
    "swing_height_m": 0.015,
}
PARETO = ["pareto", *SMALL, "--points", "5", *(f"--set={name}={value}" for name, value in FIXED.items())]
CERTAINTY = ["certainty", "walk12", "--starts", "4", "--evaluations", "0"]


def test_pareto_prints_one_object_and_writes_its_files(tmp_path: Path) -> None:
    done = nlp_gait(*PARETO, "--against", "speed", "--search", "NSGA2=100", "--runs", "1", "--out", tmp_path, "--json")
    data = json.loads(done.stdout)
    powers = [point["power_W"] for point in data["front"]]
    assert len(powers) >= 4 and powers == sorted(powers)
    assert data["criterion"] == {"name": "speed", "unit": "m/s"}
    assert [(row["solver"], row["budget"], row["runs"]) for row in data["searches"]] == [("NSGA2", 100, 1)]
    written = {Path(file).name for file in data["files"]}
    assert written >= {"nao-ssp-front-speed.csv", "nao-ssp-pareto-speed.json"}
    assert all(Path(file).stat().st_size > 0 for file in data["files"])
    again = nlp_gait(
        *PARETO, "--against", "speed", "--search", "NSGA2=100", "--runs", "1", "--out", tmp_path
    )  # from its stored results
    assert "price" in again.stdout and " W per m/s " in again.stdout and "wrote " in again.stdout


def test_certainty_prints_one_object_and_writes_its_files(tmp_path: Path) -> None:
    done = nlp_gait(*CERTAINTY, "--time-limit", "0", "--out", tmp_path, "--json")
    data = json.loads(done.stdout)
    assert data["optima"][0]["objective"] == pytest.approx(0.970839, rel=1e-5)
    assert sum(data["statuses"].values()) == 4 and data["certificate"] is None
    assert (tmp_path / "walk12-certainty.json").as_posix() in data["files"]
    assert data["best_known"] == pytest.approx(0.970835, rel=1e-5)
    assert data["best_known_source"] == "shipped, proven to six digits"
    page = (tmp_path / "walk12-certainty.md").read_text()
    assert "Best known value: 0.970835 (shipped, proven to six digits)" in page
    assert "{Goswami2008," in page.split("How to cite")[1]
    assert all(Path(file).stat().st_size > 0 for file in data["files"])


def test_a_certificate_without_time_for_a_finite_bound_says_so(tmp_path: Path) -> None:
    done = nlp_gait(*CERTAINTY, "--time-limit", "1e-9", "--out", tmp_path)
    assert "Proven: nothing: the time limit was reached before a finite bound" in done.stdout
    data = json.loads((tmp_path / "walk12-certainty.json").read_text())
    assert data["certificate"]["bound"] is None and data["certificate"]["closed"] is False


def test_a_linear_solver_that_is_not_there_is_refused() -> None:
    try:
        error = one_sentence("solve", "walk12", "--starts", "1", "--linear-solver", "ma57")
    except AssertionError:
        assert "with ma57" in nlp_gait("solve", "walk12", "--starts", "1", "--linear-solver", "ma57").stdout
        pytest.skip("ma57 is installed here")
    assert "linear solver 'ma57' does not run in this installation" in error and "leave linear_solver out" in error


def test_solve_takes_any_nlp_solver_by_name(tmp_path: Path) -> None:
    out = tmp_path / "best.json"
    shown = nlp_gait("solve", "walk12", "--starts", "1", "--solver", "slsqp", "--out", out).stdout
    written = json.loads(out.read_text())
    assert "; slsqp\n" in shown and written["solver"] == "slsqp" and written["linear_solver"] == ""
    assert written["claimed"] and written["active_constraints"] == []
