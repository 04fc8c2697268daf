"""A disk on which a power cut loses everything that was not flushed: content, names and folders, each by itself.

The model sees every call of the ``os`` module that changes the tree. After a cut a file that was flushed has at least what was
flushed, any other may be empty, cut in half or whole; of the names that came, went or changed in a folder since that was flushed,
any may have reached the disk and any not; only a renamed file keeps one of its names. Nothing is assumed about the order in
which a file system writes.
"""

from __future__ import annotations

import itertools
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

Files = dict[str, bytes]
"""What is there after a cut, by path below the folder."""

MOST_STATES = 4096


class ForgetfulDisk:
    """Watches one folder; calls ``check`` with every state that a cut before or after any operation could leave.

    Args:
        folder: empty.
        monkeypatch: of the test.
        check: raises where a state is wrong.
        flushes: False for a disk whose flushes do nothing, on which every test must fail.
    """

    def __init__(
        self,
        folder: Path,
        monkeypatch: pytest.MonkeyPatch,
        check: Callable[[Files], None],
        flushes: bool = True,
    ) -> None:
        self._folder, self._check, self._flushes = folder.resolve(), check, flushes
        self._contents: dict[int, bytes] = {}  # by inode, as flushed
        self._names: dict[int, dict[str, int]] = {folder.stat().st_ino: {}}  # by inode of a folder, as flushed
        self._kept: dict[int, int] = {}  # descriptors that keep inodes from being used again
        self.cuts = self.operations = 0
        for name in ("mkdir", "open", "rename", "replace", "unlink", "remove", "rmdir", "fsync"):
            monkeypatch.setattr(os, name, self._watched(getattr(os, name), name))

    def _watched(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        def watched(*arguments: Any, **named: Any) -> Any:
            self.cut()
            result = function(*arguments, **named)
            if name == "fsync":
                self._flushed(arguments[0])
            self.operations += 1
            self.cut()
            return result

        return watched

    def _flushed(self, descriptor: int) -> None:
        status = os.fstat(descriptor)
        path = next((p for p in [self._folder, *self._folder.rglob("*")] if p.stat().st_ino == status.st_ino), None)
        if path is None or not self._flushes:
            return
        if stat.S_ISDIR(status.st_mode):
            self._names[status.st_ino] = _entries(path)
        else:
            self._contents[status.st_ino] = path.read_bytes()

    def cut(self) -> None:
        """Check every state that a cut now could leave."""
        self._see()
        for files in self._states():
            self.cuts += 1
            self._check(files)

    def _see(self) -> None:
        """Remember what inodes hold now: another file must not take the number of one that the disk still has."""
        self._now: dict[int, bytes] = getattr(self, "_now", {})
        self._folders: dict[int, dict[str, int]] = getattr(self, "_folders", {})
        for path in [self._folder, *self._folder.rglob("*")]:
            inode = path.stat().st_ino
            if inode not in self._kept:
                self._kept[inode] = _open(path, os.O_RDONLY)
            if path.is_dir():
                self._folders[inode] = _entries(path)
            else:
                self._now[inode] = path.read_bytes()

    def _states(self) -> Iterator[Files]:
        root = self._folder.stat().st_ino
        alternatives = {inode: list(self._folder_states(inode)) for inode in self._folders}
        count = 1
        for choices in alternatives.values():
            count *= len(choices)
        assert count <= MOST_STATES, "the test does too much between two flushes"
        for chosen in itertools.product(*alternatives.values()):
            names = dict(zip(alternatives, chosen, strict=True))
            reached = dict(self._tree(names, root, ""))
            unsure = [path for path, inode in reached.items() if self._contents.get(inode) != self._now[inode]]
            for torn in itertools.product((0.0, 0.5, 1.0), repeat=len(unsure)):
                how = dict(zip(unsure, torn, strict=True))
                yield {path: self._content(inode, how.get(path, 1.0)) for path, inode in reached.items()}

    def _folder_states(self, inode: int) -> Iterator[dict[str, int]]:
        """Every mixture of the names that are flushed and those that are there now; both names of a renamed file go together."""
        old, new = self._names.get(inode, {}), self._folders[inode]
        changed = [name for name in sorted({*old, *new}) if old.get(name) != new.get(name)]
        kept = {name: number for name, number in old.items() if name not in changed}
        target = {number: name for name, number in new.items() if name in changed}
        renamed = {name: target[old[name]] for name in changed if old.get(name) in target}
        leaders = [name for name in changed if name not in renamed.values()]
        for sides in itertools.product((old, new), repeat=len(leaders)):
            state = dict(kept)
            for leader, side in zip(leaders, sides, strict=True):
                for name in {leader, renamed.get(leader, leader)}:
                    state |= {name: side[name]} if name in side else {}
            yield state

    def _tree(self, names: dict[int, dict[str, int]], folder: int, stem: str) -> Iterator[tuple[str, int]]:
        for name, inode in names[folder].items():
            if inode in self._folders:
                yield from self._tree(names, inode, f"{stem}{name}/")
            else:
                yield f"{stem}{name}", inode

    def _content(self, inode: int, part: float) -> bytes:
        now, flushed = self._now[inode], self._contents.get(inode)
        if part == 1.0:
            return now
        return flushed if flushed is not None and part == 0.0 else now[: int(part * len(now))]


_open = os.open  # before any disk watches it


def _entries(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_ino for path in folder.iterdir()}
