"""A cache that cannot be written to, or that two processes share together with an output folder."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import pytest

from compare.study.record import read_record
from nlp_gait.backends.kernel import library_cache
from nlp_gait.backends.kernel.compiler import find_compiler
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import in_own_mounts, quick_compiler, start

SEARCH = tuple("compare walk12 --algorithms pso --starts 0 --runs 3 --evaluations 500 --jobs 1".split())


def runs(folder: Path) -> dict[str, dict[str, Any]]:
    """Every record without its times."""
    found = {path.name: json.loads(path.read_text()) for path in folder.glob("records/*/*.json")}
    for record in found.values():
        del record["time_s"]
    return found


@pytest.mark.slow
def test_a_read_only_cache_costs_one_line(tmp_path: Path) -> None:
    """Mounted read-only, which stops the superuser too."""
    cache = tmp_path / "cache"
    cache.mkdir(mode=0o700)
    script = (
        'mount --bind "$2" "$2"; mount -o remount,ro,bind "$2"; export NLP_GAIT_CACHE="$2" CXX="$3"; shift 3; '
        f'exec "$PYTHON" -m nlp_gait {" ".join(SEARCH)} --out "$1"'
    )
    done = in_own_mounts('PYTHON="$1"; ' + script, str(cache), quick_compiler(tmp_path), str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("\n") == 1 and "compiled code is stored for this process only" in done.stderr
    assert "Read-only file system" in done.stderr and not list(cache.iterdir())
    assert len(runs(tmp_path / "out")) == 3


@pytest.mark.slow
def test_two_processes_share_a_cache_and_an_output_folder(tmp_path: Path) -> None:
    assert nlp_gait(*SEARCH, "--out", tmp_path / "alone").stderr == ""
    own = {"NLP_GAIT_CACHE": str(tmp_path / "cache"), "CXX": quick_compiler(tmp_path)}
    for process in [start(*SEARCH, "--out", str(tmp_path / "both"), **own) for _ in range(2)]:
        _, messages = process.communicate(timeout=120)
        assert process.returncode == 0 and messages == ""
    assert runs(tmp_path / "both") == runs(tmp_path / "alone") and len(runs(tmp_path / "both")) == 3
    assert all(read_record(path) for path in tmp_path.glob("both/records/*/*.json"))
    assert not list(tmp_path.rglob("*.tmp*"))
    assert all(library_cache.load_if_valid(file, ()) for file in (tmp_path / "cache").iterdir())


def test_a_load_makes_no_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(library_cache.FOLDER_VARIABLE, str(tmp_path))
    monkeypatch.setattr(library_cache, "make_private_folder", library_cache.cache(lambda: pytest.fail("made")))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        source = 'extern "C" int one(void) { return 1; }\n'
        for _ in range(2):
            assert library_cache.load_library(source, find_compiler(), ("-O0",), ("one",))[0].one() == 1
