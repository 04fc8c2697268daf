"""Ctrl-C in a long command, as one sentence that says what is kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from compare.cli.common import end_interrupted


@contextmanager
def resumable(folder: Path, files: str = "steps/*.json") -> Iterator[None]:
    """For a command whose finished steps are files under a folder, from which the same command goes on."""
    try:
        yield
    except KeyboardInterrupt:
        finished = len(list(folder.glob(files)))
        end_interrupted(f"interrupted; {finished} finished steps are kept in {folder}; the same command continues")


@contextmanager
def whole() -> Iterator[None]:
    """For a command that has no result before its end."""
    try:
        yield
    except KeyboardInterrupt:
        end_interrupted("interrupted; nothing was written")
