"""Ctrl-C in a long command, as one sentence that says what is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar, cast

from compare.cli.common import end_interrupted
from nlp_gait.backends.interrupts import Interrupted

R = TypeVar("R")


def until_interrupted(work: Callable[[], R], nothing: str = "nothing was written") -> tuple[R, str]:
    """What some work finds before Ctrl-C, and a sentence on where it was interrupted, "" if it was not.

    Args:
        work: raises ``Interrupted`` with the part that was found.
        nothing: what to add to the sentence if nothing was found; the command ends with it.
    """
    try:
        return work(), ""
    except Interrupted as interrupt:
        if not interrupt.partial:
            end_interrupted("; ".join(filter(None, (interrupt.sentence, nothing))))
        return cast(R, interrupt.partial), interrupt.sentence


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
