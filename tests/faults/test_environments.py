"""Environments in which libraries fail or print nothing: each is corrected, or rejected in one sentence."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from joblib.externals.loky import get_reusable_executor

from compare.__main__ import fix_environment
from metaheuristics.errors import SearchError
from metaheuristics.settings import check_installed
from nlp_gait.errors import NoWorkersError, WorkerError
from nlp_gait.processes import run_in_processes
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import ROOT


@pytest.mark.parametrize("width", ["0", "-5", "", "wide", "1e3", "٣", "0000", "80"])
def test_a_terminal_without_a_width_has_the_usual_one(width: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    fix_environment()
    assert os.environ.get("COLUMNS") == ("80" if width == "80" else None) and os.environ["MPLBACKEND"] == "agg"


def test_pycma_without_docstrings_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("metaheuristics.settings.is_installed", lambda package: True)
    monkeypatch.setattr(sys, "flags", SimpleNamespace(optimize=2))
    with pytest.raises(SearchError, match="PYTHONOPTIMIZE"):
        check_installed("cma", "cma")
    check_installed("pymoo:GA", "pymoo")


def test_workers_do_not_begin_in_a_folder_that_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with pytest.raises(WorkerError, match="the working folder is gone"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))


SHORTAGES = [
    (OSError(errno.EMFILE, "Too many open files"), "too many files are open"),
    (OSError(errno.ENFILE, "Too many open files in system"), "too many files are open"),
    (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "there are too many processes or threads"),
    (RuntimeError("can't start new thread"), "there are too many processes or threads"),
    (OSError(errno.ENOMEM, "Cannot allocate memory"), "there is not enough memory"),
    (MemoryError("std::bad_alloc"), "there is not enough memory"),
    (ImportError("x.so: failed to map segment from shared object"), "there is not enough memory"),
]


@pytest.mark.parametrize(("error", "sentence"), SHORTAGES, ids=lambda value: str(value)[:40])
def test_a_shortage_at_the_start_of_workers_is_one_sentence(
    error: Exception, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joblib hides it behind an error of its own."""

    def start(self: object) -> None:
        try:
            raise error
        finally:
            raise UnboundLocalError

    monkeypatch.setattr("joblib.externals.loky.backend.process.LokyProcess.start", start)
    get_reusable_executor().shutdown(wait=True, kill_workers=True)  # else its workers would do
    with pytest.raises(NoWorkersError, match=f"cannot begin: {sentence}; use fewer --jobs"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))


@pytest.mark.slow
def test_a_limit_of_open_files_is_one_sentence_and_keeps_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, undrawn_pictures: None
) -> None:
    line = "compare walk12 --algorithms random --starts 0 --evaluations 60 --out study --jobs"
    program = [sys.executable, "-m", "nlp_gait"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    monkeypatch.chdir(tmp_path)
    nlp_gait(*line.split(), "1", "--runs", "2")
    done = subprocess.run(
        ["sh", "-c", 'ulimit -n 24; exec "$@"', "sh", *program, *line.split(), "20", "--runs", "22"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "too many files are open" in done.stderr
    assert len(list(tmp_path.glob("study/records/*/*.json"))) == 2
