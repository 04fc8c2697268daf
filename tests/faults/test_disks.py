"""Full disks and power cuts: what is finished is whole and flushed, and one sentence says what could not be written."""

import os
import resource
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.study.record import read_record
from compare.study.run import ProblemSpec, Run, Stop
from compare.study.study import RECORDS, Study, name_record, run_study
from nlp_gait.export.formats import write_npz
from nlp_gait.formulation import Signals
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import in_own_mounts

Finished = Callable[[Path], None]
WALK = ProblemSpec(name="walk12")


@pytest.mark.slow
def test_a_study_stores_its_finished_runs_and_continues_when_there_is_room(
    tmp_path: Path, coarse_pictures: None
) -> None:
    study = "walk12 --algorithms random --runs 20 --evaluations 100 --starts 0 --jobs 1"
    script = (
        'mkdir "$2/small"; mount -t tmpfs -o size=48k none "$2/small"; '
        f'"$1" -m nlp_gait compare {study} --out "$2/small/study" || code=$?; '
        'cp -r "$2/small/study" "$2/kept"; exit $code'
    )
    done = in_own_mounts(script, str(tmp_path))
    records = sorted(tmp_path.glob("kept/records/*/*.json"))
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("nlp-gait: cannot write ") and "No space left on device" in done.stderr
    assert f"the {len(records)} runs before it are stored" in done.stderr
    assert 3 < len(records) < 20 and all(read_record(path) for path in records)
    assert not list(tmp_path.rglob("*.tmp*"))
    before = {path: path.read_bytes() for path in records}
    nlp_gait("compare", *study.split(), "--out", tmp_path / "kept")
    assert {path: path.read_bytes() for path in records} == before
    assert len(list(tmp_path.glob("kept/records/*/*.json"))) == 20


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "printed"),
    [
        ("solve walk12 --starts 2 --out {out}/best.json", "walk12: f 0.97"),
        ("sweep walk12 --over step_length_m=0.1:0.12:2 --starts 1 --out {out}", "walk12 by ipopt"),
    ],
)
def test_what_was_computed_is_printed_though_it_cannot_be_written(
    line: str, printed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # else modules that are imported now would be cut
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2048, usual[1]))
    try:
        done = nlp_gait(*line.format(out=tmp_path).split(), status=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)
    assert printed in done.stdout
    *kept, last = done.stderr.splitlines()
    assert last.startswith("nlp-gait: cannot write ") and "File too large" in last
    assert all("continuing without storing results" in line for line in kept) and len(kept) <= 1
    assert [path.name for path in tmp_path.iterdir() if path.suffix != ".csv" and path.name != "store"] == []


def write_arrays(folder: Path, finished: Finished) -> None:
    write_npz(folder / "points.npz", Signals(joints=("a",), arrays={"q": np.arange(20.0)[:, None]}, columns={}))
    finished(folder / "points.npz")


def run_a_study(folder: Path, finished: Finished) -> None:
    runs = tuple(Run(problem=WALK, solver="random", number=k, stop=Stop(evaluations=100)) for k in range(2))
    run_study(Study(runs=runs, folder=folder), lambda run: finished(folder / RECORDS / f"{name_record(run)}.json"))
    finished(folder / "study.json")


class Journal:
    """Sees which files and folders below a folder are flushed, and refuses a rename of what may still be torn."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.flushed: dict[int, tuple[int, int]] = {}  # size and time of the last change, by inode
        self.unsure: set[int] = set()  # folders with names that a power cut may lose
        self.renames = 0
        for name in ("fsync", "mkdir", "rename", "replace"):
            monkeypatch.setattr(os, name, partial(getattr(self, name), getattr(os, name)))

    def fsync(self, fsync: Callable[[int], None], descriptor: int) -> None:
        fsync(descriptor)
        state = os.fstat(descriptor)
        self.unsure.discard(state.st_ino)
        self.flushed[state.st_ino] = (state.st_size, state.st_mtime_ns)

    def mkdir(self, mkdir: Callable[..., None], path: Path, *rest: Any, **named: Any) -> None:
        mkdir(path, *rest, **named)
        self._name(Path(path))

    def rename(self, rename: Callable[..., None], source: Path, target: Path, **named: Any) -> None:
        state = os.stat(source, dir_fd=named.get("src_dir_fd"))
        if self.folder in Path(target).absolute().parents:
            assert self.flushed.get(state.st_ino) == (state.st_size, state.st_mtime_ns), f"{target} may be torn"
            self.renames += 1
        rename(source, target, **named)
        self._name(Path(target))

    replace = rename

    def _name(self, path: Path) -> None:
        if self.folder in path.absolute().parents:
            self.unsure.add(path.parent.stat().st_ino)

    def finished(self, path: Path) -> None:
        assert path.exists() and not self.unsure, f"{path} may be lost"


@pytest.mark.parametrize("write", [write_arrays, run_a_study])
def test_a_file_is_flushed_before_it_is_renamed_and_its_folder_after_that(
    write: Callable[[Path, Finished], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = Journal(tmp_path, monkeypatch)
    write(tmp_path, journal.finished)
    assert journal.renames > 0
