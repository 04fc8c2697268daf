"""Ctrl-C in a long command, as one sentence that says what is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar, cast

from compare.cli.common import end_interrupted
from nlp_gait.interrupts import Interrupted

R = TypeVar("R")


def until_interrupted(
    work: Callable[[], R], nothing: str = "nothing was written", folder: Path | None = None
) -> tuple[R, str]:
    """Return what some work finds before Ctrl-C, and a sentence on where it was interrupted, "" if it was not.

    Args:
        work: raises ``Interrupted`` with the part that was found.
        nothing: what to add to the sentence if nothing was found; the command ends with it.
        folder: in which finished results are stored; None if there is none.
    """

    def kept() -> str:
        return nothing if folder is None else describe_stored(folder)

    try:
        return work(), ""
    except Interrupted as interrupt:
        if not interrupt.partial:
            end_interrupted("; ".join(filter(None, (interrupt.sentence, kept()))))
        return cast(R, interrupt.partial), interrupt.sentence
    except KeyboardInterrupt:
        end_interrupted(f"interrupted before there was a result; {kept() or 'nothing was written'}")


def describe_stored(folder: Path) -> str:
    """Return how many results are stored in a folder, and how to continue."""
    finished = sum(1 for files in ("store/**/*.json", "records/*/*.json") for _ in folder.glob(files))
    return f"{finished} finished results are stored in {folder}; rerun the command to continue"


@contextmanager
def interruptible(folder: Path | None = None) -> Iterator[None]:
    """For a command that has no result before its end, or that continues from the results that are stored in a folder."""
    try:
        yield
    except KeyboardInterrupt:
        end_interrupted(f"interrupted; {'nothing was written' if folder is None else describe_stored(folder)}")
