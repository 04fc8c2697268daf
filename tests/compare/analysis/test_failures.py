"""Runs that fail in a comparison: said on stderr, with the reason in the table, and status 1 where a solver has no run left."""

import json
from pathlib import Path
from typing import Any

import pytest

from metaheuristics import ParticleSwarm
from tests.compare.cli.calls import nlp_gait

pytestmark = pytest.mark.usefixtures("coarse_pictures")
STUDY = "compare walk12 --algorithms pso,ga --runs 2 --starts 0 --evaluations 100 --jobs 1".split()


def failing(monkeypatch: pytest.MonkeyPatch, calls: int) -> None:
    """The first runs of PSO fail."""
    start, done = ParticleSwarm.start, 0

    def counted(self: ParticleSwarm, *arguments: Any) -> Any:
        nonlocal done
        done += 1
        if done <= calls:
            raise RuntimeError("no home")
        return start(self, *arguments)

    monkeypatch.setattr(ParticleSwarm, "start", counted)


def test_a_solver_without_any_run_ends_a_comparison_with_status_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing(monkeypatch, 1)
    with_a_run_left = nlp_gait(*STUDY, "--out", tmp_path / "left")
    assert with_a_run_left.stderr.startswith("nlp-gait: walk12, PSO: 1 of 2 runs have no result (run 0 failed: ")
    assert with_a_run_left.stderr.count("\n") == 1
    monkeypatch.undo()
    failing(monkeypatch, 2)
    first, last = nlp_gait(*STUDY, "--out", tmp_path, status=1).stderr.splitlines()
    assert first == "nlp-gait: walk12, PSO: both runs have no result (run 0 failed: RuntimeError: no home)"
    assert last.startswith("nlp-gait: without any result: pso; fix the cause")
    assert "RuntimeError: no home" in (tmp_path / "report.md").read_text()
    again = nlp_gait(*STUDY, "--out", tmp_path, "--json", status=1)
    assert json.loads(again.stdout)["problems"]["walk12"]
