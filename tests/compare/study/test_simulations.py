"""Simulated gaits of a study: each is simulated once, again when something has changed, and read without the engine."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.study import simulations
from compare.study.record import RunRecord
from compare.study.record_files import write_records
from compare.study.simulations import load_simulations, simulate_records
from compare.study.store import Store
from nlp_gait.errors import InputError
from nlp_gait.formulation import Display
from nlp_gait.simulation.drive import DRIVES, Drive
from tests.compare.records import FAST_X, judged

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("coarse_pages")]  # gaits are played


def dsp(algorithm: str, time_s: float = 0.5, solve_s: float = 0.5) -> RunRecord:
    return judged(algorithm, FAST_X | {"double_support_time_s": time_s}, solve_s=solve_s)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two solvers with a gait each."""
    pytest.importorskip("mujoco")
    path = tmp_path_factory.mktemp("study")
    write_records([dsp("pso"), dsp("ga", 0.51, solve_s=0.6)], path)
    return path


@pytest.fixture(scope="module")
def report(folder: Path) -> dict[str, object]:
    done = CliRunner().invoke(app, ["report", str(folder), "--engine", "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)["engine"]["nao-dsp"]


def refuse(*_: object, **__: object) -> None:
    raise AssertionError("played again")


def test_the_command_simulates_each_solvers_best_gait(report: dict[str, object], folder: Path) -> None:
    gaits = report["gaits"]
    assert isinstance(gaits, list)
    assert [gait["solver"] for gait in gaits] == ["ga", "pso"]
    for gait in gaits:
        assert gait["unit"] == "W" and gait["fell_at_s"] is None and gait["steps"] is None
        assert gait["engine"] == pytest.approx(gait["model"], rel=0.2)
    agreement = report["agreement"]
    assert isinstance(agreement, dict) and agreement["gaits"] == 2 and agreement["spearman"] is None
    page = (folder / "report.md").read_text()
    assert "In the physics engine" in page and f"{gaits[0]['engine']:#.4g} W" in page
    assert "have not been played" not in page


def test_a_later_report_shows_it_without_the_engine(
    report: dict[str, object], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    (folder / "report.md").unlink()
    done = CliRunner().invoke(app, ["report", str(folder)])
    assert done.exit_code == 0 and "In the physics engine" in (folder / "report.md").read_text()
    refused = CliRunner().invoke(app, ["report", str(folder), "--engine"])
    assert refused.exit_code == 1 and "pip install 'nlp-gait[sim]'" in refused.stderr


def test_a_stored_simulation_is_not_repeated(
    report: dict[str, object], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulations, "simulate_plan", refuse)
    gaits = report["gaits"]
    assert isinstance(gaits, list)
    assert [p.engine for p in simulate_records(folder, [dsp("pso")], Drive())] == [gaits[1]["engine"]]
    with pytest.raises(AssertionError, match="played again"):
        simulate_records(folder, [dsp("pso")], DRIVES["held"])
    with pytest.raises(AssertionError, match="played again"):
        simulate_records(folder, [dsp("pso", 0.55)], Drive())


def test_a_gait_that_has_changed_has_no_simulation_to_show(report: dict[str, object], folder: Path) -> None:
    assert len(load_simulations(folder, [dsp("pso"), dsp("ga", 0.51)])) == 2
    assert load_simulations(folder, [dsp("pso", 0.55), dsp("aco")]) == []


def test_problems_that_cannot_be_simulated_are_left_out_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    still = SimpleNamespace(problem=SimpleNamespace(display=Display()))
    monkeypatch.setattr(simulations, "load_gait", lambda _: still)
    assert simulate_records(tmp_path, [dsp("pso")], Drive()) == []
    write_records([dsp("pso")], tmp_path)
    refused = CliRunner().invoke(app, ["report", str(tmp_path), "--engine"])
    assert refused.exit_code == 1 and "no gait of nao-dsp can be simulated" in refused.stderr


def test_a_damaged_simulation_is_refused_with_its_remedy(tmp_path: Path) -> None:
    gait = dsp("pso")
    inputs = {"problem": gait.inputs.problem, "x": dict(gait.x), "drive": asdict(Drive())}
    Store(tmp_path).save("simulations/nao-dsp/pso-0", inputs, {})
    with pytest.raises(InputError, match="delete it and rerun with --engine"):
        load_simulations(tmp_path, [dsp("pso")])


def test_a_report_without_simulations_says_how_to_get_them(tmp_path: Path) -> None:
    write_records([dsp("pso")], tmp_path)
    done = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert done.exit_code == 0
    assert "`nlp-gait report DIR --engine`" in (tmp_path / "report.md").read_text()
