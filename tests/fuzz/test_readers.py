"""Damaged files are refused in one sentence, or accepted for what they say."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.fuzz.campaign import tried
from tests.fuzz.readers import FORMATS, Format, prepared
from tests.fuzz.trial import outcome

INPUTS = 250  # of each kind
FEWER = {"mjcf": 20, "certificate": 60, "biped": 100}  # MJCF is read in a process for each file, the others are slow
CORPUS = Path(__file__).with_name("corpus")
KEPT = sorted(path for path in CORPUS.glob("*/*") if path.is_file())
BY_NAME = {form.name: form for form in FORMATS}


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_valid_files_are_accepted(form: Format, tmp_path: Path) -> None:
    path = prepared(form, tmp_path)
    for data in form.seeds():
        path.write_bytes(data)
        assert outcome(lambda: form.read(path)) == "accepted"


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_mutated_files(form: Format, tmp_path: Path) -> None:
    count = FEWER.get(form.name, INPUTS)
    tally = tried(form, count, 0, tmp_path)
    assert not tally.defects, tally.defects[0]
    assert tally.accepted + tally.refused == count


@pytest.mark.parametrize("kept", KEPT, ids=lambda path: path.relative_to(CORPUS).as_posix())
def test_kept_inputs(kept: Path, tmp_path: Path) -> None:
    """Most once did harm. Names in the corpus say what must become of a file: ``refused-...`` or ``accepted-...``."""
    form = BY_NAME[kept.parent.name]
    path = prepared(form, tmp_path)
    path.write_bytes(kept.read_bytes())
    assert outcome(lambda: form.read(path)) == kept.name.split("-")[0]


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "loop", "dangling", "empty", "bytes"])
def test_what_is_not_a_file_is_refused_at_once(form: Format, kind: str, tmp_path: Path) -> None:
    """A pipe would wait for its writer, and /dev/zero never ends."""
    path = prepared(form, tmp_path)
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "dangling":
        path.symlink_to("nowhere")
    else:
        path.write_bytes(b"" if kind == "empty" else bytes(range(256)))
    expected = ("refused", "accepted") if form.name == "stored" else ("refused",)  # it is recomputed
    assert outcome(lambda: form.read(path)) in expected


@pytest.mark.parametrize("form", [f for f in FORMATS if f.name not in ("stored", "points")], ids=lambda form: form.name)
def test_a_link_to_a_file_is_read_and_a_huge_one_is_not(form: Format, tmp_path: Path) -> None:
    path = prepared(form, tmp_path)
    target = tmp_path / f"target{path.suffix}"
    target.write_bytes(form.seeds()[0])
    path.symlink_to(target)
    assert outcome(lambda: form.read(path)) == "accepted"
    with open(target, "r+b") as file:
        file.truncate(2**27)  # without a block on the disk
    assert outcome(lambda: form.read(path)) == "refused"


VERSIONED = {
    "result": (b'"schema": 1', (b'"schema": 0', b'"schema": 2', b'"schema": true', b'"schema": "1"')),
    "record": (b'"schema": 4', (b'"schema": 3', b'"schema": 5', b'"schema": 4.0', b'"scheme": 4')),
    "manifest": (b'"schema": 1', (b'"schema": 0', b'"schema": 2', b'"schema": true', b'"scheme": 1')),
    "study": (b"schema = 1", (b"schema = 0", b"schema = 2", b"schema = true", b'schema = "1"')),
    "robot": (b'"schema": 1', (b'"schema": 0', b'"schema": 2', b'"schema": true', b'"scheme": 1')),
}


@pytest.mark.parametrize("name", VERSIONED)
def test_another_version_is_refused_by_name(name: str, tmp_path: Path) -> None:
    form, (own, others) = BY_NAME[name], VERSIONED[name]
    path, data = prepared(form, tmp_path), next(seed for seed in BY_NAME[name].seeds() if own in seed)
    for other in others:
        path.write_bytes(data.replace(own, other, 1))
        with pytest.raises(Exception, match="schem") as error:
            form.read(path)
        assert path.name in str(error.value)


@pytest.mark.parametrize("name", ["result", "study"])
def test_files_without_a_version_are_the_first(name: str, tmp_path: Path) -> None:
    """Results and studies are written by hand too, and were written without it."""
    form, (own, _) = BY_NAME[name], VERSIONED[name]
    path, data = prepared(form, tmp_path), next(seed for seed in BY_NAME[name].seeds() if own in seed)
    path.write_bytes(data.replace(own + b",", b"").replace(own, b""))
    assert outcome(lambda: form.read(path)) == "accepted"
