"""Runs that fail in a comparison: said on stderr, with the reason in the table, and status 1 where a solver has no run left."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from metaheuristics import ParticleSwarm
from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.kernel.library_cache import FOLDER_VARIABLE
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import ROOT

pytestmark = pytest.mark.usefixtures("coarse_pictures")
STUDY = "compare walk12 --algorithms pso,ga --runs 2 --starts 0 --evaluations 100 --jobs 1".split()


def quick_compiler(folder: Path) -> str:
    """Write a compiler that does not optimise, for tests of caches, which compile into an empty one."""
    path = folder / "quick_compiler.sh"
    path.write_text(f'#!/bin/sh\nexec {shlex.join(find_compiler().command)} "$@" -O0\n', encoding="utf-8")
    path.chmod(0o700)
    return str(path)


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
    assert first == "nlp-gait: walk12, PSO: 2 of 2 runs have no result (run 0 failed: RuntimeError: no home)"
    assert last.startswith("nlp-gait: without any result: pso; fix the cause")
    assert "RuntimeError: no home" in (tmp_path / "report.md").read_text()
    again = nlp_gait(*STUDY, "--out", tmp_path, "--json", status=1)
    assert json.loads(again.stdout)["problems"]["walk12"]


def test_a_container_whose_user_has_no_entry(tmp_path: Path) -> None:
    # The user's entry is gone for this process only; reading it fails as it does for a number without one.
    sitecustomize = tmp_path / "sitecustomize.py"
    sitecustomize.write_text(
        "import pwd\ndef missing(*_):\n    raise KeyError('getpwuid(): uid not found')\npwd.getpwuid = missing\n"
    )
    kept = {key: value for key, value in os.environ.items() if key not in ("HOME", "XDG_CACHE_HOME", FOLDER_VARIABLE)}
    search = "compare walk12 --algorithms pso --starts 0 --runs 1 --evaluations 100 --jobs 1 --out"
    study = (*search.split(), str(tmp_path / "study"))
    done = subprocess.run(
        [sys.executable, "-m", "nlp_gait", *study],
        cwd=ROOT,
        env={**kept, "PYTHONPATH": f"{tmp_path}:{ROOT}", "CXX": quick_compiler(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "report.html" in done.stdout and "Traceback" not in done.stderr
    assert "compiled code is stored for this process only" in done.stderr
