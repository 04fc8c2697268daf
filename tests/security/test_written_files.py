"""Files that are written: by this process alone, under their own name, through no link."""

import csv
import io
import os
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from compare.drawing.figures import save_figure
from nlp_gait.errors import OutputError
from nlp_gait.export.formats import write_npz
from nlp_gait.files import format_csv, replace_file, write_text
from nlp_gait.formulation import Signals

SIGNALS = Signals(joints=("a",), arrays={"q": np.zeros((2, 1))}, columns={})
WRITERS: dict[str, Callable[[Path], object]] = {
    ".txt": lambda path: write_text(path, "new"),
    ".npz": lambda path: write_npz(path, SIGNALS),
    ".png": lambda path: save_figure(Figure(figsize=(1, 1)), path),
}


@pytest.mark.parametrize("dangling", [False, True])
@pytest.mark.parametrize("suffix", WRITERS)
def test_no_writer_follows_a_link(tmp_path: Path, suffix: str, dangling: bool) -> None:
    theirs, link = tmp_path / "theirs", tmp_path / f"ours{suffix}"
    if not dangling:
        theirs.write_text("untouched")
    link.symlink_to(theirs)
    WRITERS[suffix](link)
    assert not theirs.exists() if dangling else theirs.read_text() == "untouched"
    assert not link.is_symlink() and link.stat().st_size > 0
    assert not list(tmp_path.glob(".*"))


def test_the_temporary_file_is_new_and_cannot_be_guessed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = set()
    for _ in range(2):
        with replace_file(tmp_path / "a.txt") as temporary:
            names.add(temporary.name)
    assert len(names) == 2
    monkeypatch.setattr("secrets.token_hex", lambda count: "guess")  # a link waits there
    (tmp_path / "theirs").write_text("untouched")
    (tmp_path / ".guess.tmp").symlink_to(tmp_path / "theirs")
    with pytest.raises(OutputError, match="File exists"):
        write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "theirs").read_text() == "untouched"


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600)])
def test_files_have_the_permissions_that_the_user_gives(tmp_path: Path, mask: int, mode: int) -> None:
    before = os.umask(mask)
    try:
        write_text(tmp_path / "a.txt", "x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == mode


def test_a_device_a_pipe_or_a_folder_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "device").symlink_to("/dev/null")
    for name in ("pipe", "folder", "device"):
        with pytest.raises(OutputError, match=rf"cannot write .*{name}': it is (not a regular file|a folder)"):
            write_text(tmp_path / name, "x")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode) and (tmp_path / "device").is_symlink()


def test_nothing_is_left_when_writing_fails(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(OutputError, match="cannot write"):
        write_text(tmp_path / "a.txt", "half a character: \ud800")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"] and (tmp_path / "a.txt").read_text() == "old"


@pytest.mark.parametrize("sign", ["=", "+", "-", "@", "\t=", " =", "\n@"])
def test_no_cell_of_a_table_is_a_formula(sign: str) -> None:
    """A spreadsheet computes what begins like one: statuses, labels and names come from user code."""
    for text in (f"{sign}HYPERLINK(1)", f"{sign}cmd|'/C calc'!A0", f"{sign}1+1"):
        ((cell, other),) = csv.reader(io.StringIO(format_csv([[text, "plain"]]), newline=""))
        assert cell == f"'{text}" and other == "plain"
    numbers = ["-1.5", "+2", "-1e-300", "-inf", "-", "1", -1.5, True]
    assert format_csv([numbers]) == "-1.5,+2,-1e-300,-inf,-,1,-1.5,True\n"
