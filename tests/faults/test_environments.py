"""Environments in which libraries fail or print nothing: each is corrected, or rejected in one sentence."""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from compare.__main__ import fix_environment
from metaheuristics.errors import SearchError
from metaheuristics.settings import check_installed
from nlp_gait.errors import WorkerError
from nlp_gait.processes import run_in_processes


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
