"""A power cut: every file is flushed before it gets its name, and its folder after that."""

from __future__ import annotations

import ast
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.study.record_files import locate_record, write_record
from compare.study.run_study import Study, run_study
from compare.study.settings import Session, SolverSpec, StudySettings, write_manifest
from compare.study.store import Store
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait import files
from nlp_gait.backends.kernel import library_cache
from nlp_gait.export.formats import write_npz
from nlp_gait.files import make_writable_folder, write_json
from nlp_gait.formulation import Signals
from tests.compare.records import record

ROOT = Path(__file__).parents[2]
Finished = Callable[[Path], None]
WALK = ProblemSpec(name="walk12")


def one_file_again_and_again(folder: Path, finished: Finished) -> None:
    for version in range(3):
        write_json(folder / "answer.json", {"version": version, "more": "x" * 100})
        finished(folder / "answer.json")


def a_file_in_new_folders(folder: Path, finished: Finished) -> None:
    inner = make_writable_folder(folder / "records" / "walk12")
    write_json(inner / "pso-0000.json", [1])
    finished(inner / "pso-0000.json")


def an_archive(folder: Path, finished: Finished) -> None:
    write_npz(folder / "points.npz", Signals(joints=("a",), arrays={"q": np.arange(20.0)[:, None]}, columns={}))
    finished(folder / "points.npz")


def a_study(folder: Path, finished: Finished) -> None:
    tasks = tuple(Task(problem=WALK, solver="random", run=run, stop=Stop(evaluations=100)) for run in range(2))
    study = Study(
        tasks=tasks,
        folder=folder,
        run=lambda task, _: replace(
            record("random", task.run, [(9, 1.0)], problem="walk12"), definition=task.definition()
        ),
    )
    run_study(study, lambda task, _: finished(locate_record(folder, task)))


def a_record_of_another_definition(folder: Path, finished: Finished) -> None:
    old = record("pso", 0, [(9, 1.0)])
    finished(write_record(old, folder))
    new = replace(old, definition={**old.definition, "stop": {"evaluations": 10}})
    path = write_record(new, folder)
    finished(path)
    (other,) = [file for file in path.parent.glob("*.json") if file != path]
    finished(other)


def results_of_a_reproduction(folder: Path, finished: Finished) -> None:
    store = Store(folder)
    for inputs in ({"seed": 1}, {"seed": 2}):
        store.compute("one", inputs, lambda inputs=inputs: [inputs["seed"]] * 10)
        finished(folder / "store" / "one.json")


def sessions_of_a_study(folder: Path, finished: Finished) -> None:
    settings = StudySettings(problems=(WALK,), solvers=(SolverSpec(name="pso"),))
    session = Session(command="x", started="now", machine={}, versions={}, kernel="", jobs="1")
    for _ in range(2):
        write_manifest(folder, settings, session)
        finished(folder / "study.json")


def a_compiled_library(folder: Path, finished: Finished) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(library_cache.FOLDER_VARIABLE, str(folder / "cache"))
        built = folder.parent / "library.so"
        built.write_bytes(b"code" * 20)
        finished(library_cache.store_library(built, "key"))


SCENARIOS = (
    one_file_again_and_again,
    a_file_in_new_folders,
    an_archive,
    a_study,
    a_record_of_another_definition,
    results_of_a_reproduction,
    sessions_of_a_study,
    a_compiled_library,
)


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


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_what_is_finished_was_flushed_before_it_was_renamed_and_its_folder_after_that(
    scenario: Callable[[Path, Finished], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = Journal(tmp_path, monkeypatch)
    scenario(tmp_path, journal.finished)
    assert journal.renames > 0


@pytest.mark.parametrize("kind", ["may be torn", "may be lost"])
def test_without_flushes_of_files_or_of_folders_it_is_not(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The test above can fail."""
    flush = files.flush
    monkeypatch.setattr(files, "flush", lambda path: None if path.is_dir() == (kind == "may be lost") else flush(path))
    with pytest.raises(AssertionError, match=kind):
        one_file_again_and_again(tmp_path, Journal(tmp_path, monkeypatch).finished)


# Writers that hold a temporary file of ``replace_file``, or write where nothing is kept.
ALLOWED = {
    "nlp_gait/files.py",
    "nlp_gait/backends/kernel/library_cache.py",  # in its workshop; what is kept goes through nlp_gait.files
    "nlp_gait/export/formats.py",
    "nlp_gait/simulation/video.py",
    "compare/archive/unpack.py",  # into a temporary folder
    "compare/drawing/animation.py",
    "compare/drawing/figures.py",
    "compare/drawing/notebook_figure.py",  # into memory
    "compare/study/store.py",
    "nlp_gait/proofs/checkpoint.py",
    "nlp_gait/processes.py",  # /dev/null
}
WRITING = ("write_text", "write_bytes", "savefig", "savez", "savez_compressed", "replace", "rename", "mkdir", "touch")


def writes(text: str) -> Iterator[str]:
    """Calls that write or rename files; ``replace`` of texts and data classes takes more than one argument."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            own = isinstance(node.func, ast.Name)
            modes = [
                a.value for a in [*node.args[1:2], *(k.value for k in node.keywords)] if isinstance(a, ast.Constant)
            ]
            if name == "open" and any(isinstance(mode, str) and set(mode) & set("wax+") for mode in modes):
                yield f"line {node.lineno}: open for writing"
            elif name in WRITING and not own and not (name == "replace" and len(node.args) != 1):
                yield f"line {node.lineno}: {name}"


@pytest.mark.slow
def test_every_writer_goes_through_one_module() -> None:
    found = {}
    for package in ("nlp_gait", "metaheuristics", "compare"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if any(f"{word}(" in text for word in (*WRITING, "open")) and (calls := list(writes(text))):
                found[path.relative_to(ROOT).as_posix()] = calls
    assert found.keys() <= ALLOWED, {name: calls for name, calls in found.items() if name not in ALLOWED}
