"""Flushing what was written: which folders, in which order, and what happens where a system cannot."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from nlp_gait import files as disk


@pytest.fixture
def flushed(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    found: list[Path] = []
    monkeypatch.setattr(disk, "flush", found.append)
    return found


def test_a_new_folder_is_flushed_from_the_outside_in(tmp_path: Path, flushed: list[Path]) -> None:
    disk.make_folder(tmp_path / "a" / "b" / "c", 0o700)
    assert flushed == [tmp_path, tmp_path / "a", tmp_path / "a" / "b"]
    assert (tmp_path / "a" / "b" / "c").stat().st_mode & 0o777 == 0o700
    disk.make_folder(tmp_path / "a" / "b" / "d")
    assert flushed[3:] == [tmp_path / "a" / "b"]
    disk.make_folder(tmp_path / "a" / "b")  # is there: nothing happens
    assert len(flushed) == 4


def test_a_folder_is_open_as_the_user_has_it(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        disk.make_folder(tmp_path / "new")
    finally:
        os.umask(before)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o750


@pytest.mark.parametrize("number", [errno.EINVAL, errno.EPERM, errno.EIO])
def test_only_folders_may_be_left_to_the_file_system(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """EINVAL is what some network file systems answer to a folder's flush; EIO is a broken disk."""

    def broken(descriptor: int) -> None:
        os.fstat(descriptor)  # it is open
        raise OSError(number, "no flush")

    opened = set(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else set()
    monkeypatch.setattr(disk.os, "fsync", broken)
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(OSError, match="no flush"):
        disk.flush(file)
    if number == errno.EIO:
        with pytest.raises(OSError, match="no flush"):
            disk.flush(tmp_path)
    else:
        disk.flush(tmp_path)
    assert not opened or set(os.listdir("/proc/self/fd")) == opened
    monkeypatch.undo()
    with pytest.raises(FileNotFoundError):
        disk.flush(tmp_path / "absent")
