"""What commands print: tables, results, progress, and the one sentence that a command ends with where it fails."""

from __future__ import annotations

import json
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import without_nan, writable_folder

T = TypeVar("T")

# Characters of an error; a value in it can be a whole file.
LONGEST_SENTENCE = 2000
# Wide enough for every table where there is no terminal to fit, for example in a pipe or a log.
PIPE_WIDTH = 160


class PlainConsole(Console):
    """Console on which text is text: no markup, and control characters are shown, not obeyed."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Text as it is printed, titles and cells of tables included."""
        return super().render_str(harmless(text), **options)


def harmless(text: str) -> str:
    """Text with escapes in place of control characters and of what is not a character at all.

    Spaces of another width, as between thousands, stay although Python does not call them printable.
    """
    kept = {sign for sign in text if sign in "\n\t" or sign.isprintable() or unicodedata.category(sign) == "Zs"}
    return "".join(sign if sign in kept else repr(sign)[1:-1] for sign in text)


stderr = PlainConsole(stderr=True, highlight=False, markup=False)
stdout = PlainConsole(highlight=False, markup=False, width=None if sys.stdout.isatty() else PIPE_WIDTH)


def end_interrupted(sentence: str) -> NoReturn:
    """End with status 130 and one sentence that says what was kept."""
    fail(sentence, status=130)


def fail(message: str, status: int = 1) -> NoReturn:
    """End with a status and one sentence."""
    said = " ".join(message.split())
    shown = said if len(said) <= LONGEST_SENTENCE else f"{said[:LONGEST_SENTENCE]} ..."
    stderr.print(f"nlp-gait: {shown}", soft_wrap=True)
    raise typer.Exit(status)


def say(sentence: str) -> None:
    """A sentence on stderr, beside what a command prints."""
    stderr.print(sentence, soft_wrap=True)


def print_json(data: Any) -> None:
    """One JSON object on stdout; what is not finite is null, because not every reader accepts NaN."""
    sys.stdout.write(json.dumps(without_nan(data), indent=1, allow_nan=False) + "\n")


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Table on stdout; the first column is left-aligned."""
    table = Table(title=title, title_justify="left")
    for i, name in enumerate(header):
        table.add_column(name, justify="left" if i == 0 else "right", overflow="fold")
    for row in rows:
        table.add_row(*row)
    stdout.print(table)


def print_rows(title: str, items: Iterable[T], columns: Mapping[str, Callable[[T], str]]) -> None:
    """Table on stdout with a row for each item: under each heading, what it says of the item."""
    print_table(title, list(columns), [[cell(item) for cell in columns.values()] for item in items])


def print_result(as_json: bool, data: Mapping[str, Any], written: Iterable[Path], tables: Callable[[], object]) -> None:
    """What a command found and the files that it wrote: as one JSON object, or as its tables and a line for each file."""
    if as_json:
        print_json({**data, "files": [str(path) for path in written]})
        return
    tables()
    print_written(*written)


def print_written(*paths: Path) -> None:
    """A line for each file that was written."""
    for path in paths:
        stdout.print(f"wrote {path}", soft_wrap=True)


@contextmanager
def progress_bar(description: str, total: int | None) -> Iterator[Callable[[str], None]]:
    """Progress on stderr, of unknown length if total is None; the function inside advances it by one and shows a note."""
    if not stderr.is_terminal:
        yield lambda note: None
        return
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", markup=False),
    )
    with Progress(*columns, console=stderr, transient=True) as progress:
        task = progress.add_task(harmless(description), total=total, note="")
        yield lambda note: progress.update(task, advance=1, note=harmless(note))


def output_file(path: Path) -> Path:
    """Path that can be written to, checked before the work."""
    writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
    except OSError as error:  # its name is too long
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    return path
