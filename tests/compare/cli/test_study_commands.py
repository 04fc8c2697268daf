"""`compare` and `report` as scripts use them, also where runs fail."""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from compare.cli.compare import list_solver_names
from metaheuristics import ParticleSwarm
from tests.compare.cli.calls import as_json, nlp_gait

pytestmark = pytest.mark.usefixtures("coarse_pages")

STUDY = "compare walk12 --algorithms pso --runs 1 --starts 1 --evaluations 300 --jobs 1".split()


@pytest.fixture(scope="module")
def folder(coarse_pages: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("study")
    done = as_json(*STUDY, "--out", out / "out")
    assert [s["solver"] for s in done["problems"]["walk12"]] == ["ipopt", "pso"]
    assert all(Path(file).stat().st_size for file in done["files"])
    return out / "out"


def test_the_same_command_keeps_everything(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = {path: path.stat().st_mtime_ns for path in folder.glob("records/*/*.json")}
    assert len(before) == 2
    arguments = [*STUDY, "--out", str(folder)]
    monkeypatch.setattr(sys, "argv", ["nlp-gait", *arguments])  # which the study records
    nlp_gait(*arguments)
    assert {path: path.stat().st_mtime_ns for path in folder.glob("records/*/*.json")} == before
    study = json.loads((folder / "study.json").read_text())
    assert "walk12" in study["command"] and study["date"] and len(study["runs"]) == 2


def test_report_is_rebuilt_from_records_alone(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "records", tmp_path / "records")
    files = as_json("report", str(tmp_path))["files"]
    assert (tmp_path / "report.html").as_posix() in files
    assert "pso" in (tmp_path / "report.md").read_text()


def test_all_are_the_installed_searches_and_both_gradient_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[list_solver_names.__module__], "list_installed_algorithms", lambda: ("pso", "de"))
    names = list_solver_names("all,ga", 5)
    assert names == ["ipopt", "slsqp", "pso", "de", "ga"]


FAILING = "compare walk12 --algorithms pso,ga --runs 2 --starts 0 --evaluations 100 --jobs 1".split()


def make_pso_fail(monkeypatch: pytest.MonkeyPatch, calls: int) -> None:
    """The first runs of PSO fail."""
    start, done = ParticleSwarm.start, 0

    def start_or_fail(self: ParticleSwarm, *arguments: Any) -> Any:
        nonlocal done
        done += 1
        if done <= calls:
            raise RuntimeError("no home")
        return start(self, *arguments)

    monkeypatch.setattr(ParticleSwarm, "start", start_or_fail)


def test_a_solver_without_any_run_ends_a_comparison_with_status_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_pso_fail(monkeypatch, 1)
    with_a_run_left = nlp_gait(*FAILING, "--out", tmp_path / "left")
    assert with_a_run_left.stderr.startswith("nlp-gait: walk12, PSO: 1 of 2 runs have no result (run 0 failed: ")
    assert with_a_run_left.stderr.count("\n") == 1
    monkeypatch.undo()
    make_pso_fail(monkeypatch, 2)
    first, last = nlp_gait(*FAILING, "--out", tmp_path, status=1).stderr.splitlines()
    assert first == "nlp-gait: walk12, PSO: both runs have no result (run 0 failed: RuntimeError: no home)"
    assert last.startswith("nlp-gait: without any result: pso; fix the cause")
    assert "RuntimeError: no home" in (tmp_path / "report.md").read_text()
    again = nlp_gait(*FAILING, "--out", tmp_path, "--json", status=1)
    assert json.loads(again.stdout)["problems"]["walk12"]
