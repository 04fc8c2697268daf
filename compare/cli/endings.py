"""How commands end: with one sentence on an error, on what is stored after Ctrl-C, or on excluded records."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, TypeVar, cast

import typer

from compare.cli.printing import stderr
from nlp_gait.interrupts import Interrupted

T = TypeVar("T")

LONGEST_SENTENCE = 2000  # characters of an error message, in which a value can be a whole file
MOST_EXCLUDED = 20  # records named on a terminal


def end_interrupted(sentence: str) -> NoReturn:
    """End with status 130 and one sentence about the stored results."""
    fail(sentence, status=130)


def fail(message: str, status: int = 1) -> NoReturn:
    """End with a status and one sentence."""
    say_error(message)
    raise typer.Exit(status)


def end_if_excluded(excluded: Sequence[str]) -> None:
    """Report sentences about records that are no evidence on stderr, and end with status 1 if there are any."""
    for sentence in excluded[:MOST_EXCLUDED]:
        say_error(f"excluded {sentence}")
    if excluded:
        more = f" ({len(excluded) - MOST_EXCLUDED} more are in the report)" if len(excluded) > MOST_EXCLUDED else ""
        count = f"{len(excluded)} record{'s were' if len(excluded) > 1 else ' was'} excluded{more}"
        fail(f"{count}; delete what is named, and rerun the study to compute it again")


def say_error(message: str) -> None:
    """Print the sentence of an error on stderr."""
    text = " ".join(message.split())
    text = text if len(text) <= LONGEST_SENTENCE else f"{text[:LONGEST_SENTENCE]} ..."
    stderr.print(f"nlp-gait: {text}", soft_wrap=True)


def run_until_interrupted(work: Callable[[], T], nothing: str = "nothing was written") -> tuple[T, str]:
    """Return what some work finds before Ctrl-C, and a sentence on where it was interrupted, "" if it was not.

    ``Interrupted`` carries the part that was found; if it is empty, the command ends with the sentence and ``nothing``.
    """
    try:
        return work(), ""
    except Interrupted as interrupt:
        if not interrupt.partial:
            end_interrupted("; ".join(filter(None, (interrupt.sentence, nothing))))
        return cast(T, interrupt.partial), interrupt.sentence
    except KeyboardInterrupt:
        end_interrupted(f"interrupted before there was a result; {nothing or 'nothing was written'}")


def describe_stored(folder: Path) -> str:
    """Return how many results are stored in a folder, and how to continue."""
    finished = sum(1 for files in ("store/**/*.json", "records/*/*.json") for _ in folder.glob(files))
    return f"{finished} finished results are stored in {folder}; rerun the command to continue"


@contextmanager
def report_interrupts(sentence: str = "interrupted; nothing was written", folder: Path | None = None) -> Iterator[None]:
    """End with the sentence, or with the number of results stored in a folder, if Ctrl-C is pressed inside."""
    try:
        yield
    except KeyboardInterrupt:
        end_interrupted(sentence if folder is None else f"interrupted; {describe_stored(folder)}")
