"""What commands print: tables, results, progress, and the one sentence that a command ends with where it fails."""

from __future__ import annotations

import json
import sys
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeVar

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import check_name, make_writable_folder, replace_nan

T = TypeVar("T")

# Characters of an error; a value in it can be a whole file.
LONGEST_SENTENCE = 2000
STACKED_WIDTH = 60  # up to here a table is stacked: a block of lines for each row
LONGEST_CELL = 24  # characters up to which a cell is kept on one line
LOG_PERIOD_S = 30.0  # between two lines of progress in a log
GAP = 3  # columns of a terminal between two columns of a table


class PlainConsole(Console):
    """Console on which text is text: no markup, and control characters are shown, not obeyed."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Text as it is printed, titles and cells of tables included."""
        return super().render_str(harmless(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """As any console; where there is no terminal, a sentence is one line, so that a program can look for it."""
        if not self.is_terminal and all(isinstance(item, str) for item in objects):
            options.setdefault("soft_wrap", True)
        super().print(*objects, **options)


def harmless(text: str) -> str:
    """Text with escapes in place of control characters and of what is not a character at all.

    Spaces of another width, as between thousands, stay although Python does not call them printable.
    """
    kept = {sign for sign in text if sign in "\n\t" or sign.isprintable() or unicodedata.category(sign) == "Zs"}
    return "".join(sign if sign in kept else repr(sign)[1:-1] for sign in text)


stderr = PlainConsole(stderr=True, highlight=False, markup=False)
stdout = PlainConsole(highlight=False, markup=False)  # 80 columns where no terminal says otherwise


def end_interrupted(sentence: str) -> NoReturn:
    """End with status 130 and one sentence that says what was kept."""
    fail(sentence, status=130)


def fail(message: str, status: int = 1) -> NoReturn:
    """End with a status and one sentence."""
    say_error(message)
    raise typer.Exit(status)


def say_error(message: str) -> None:
    """The sentence of an error on stderr."""
    said = " ".join(message.split())
    shown = said if len(said) <= LONGEST_SENTENCE else f"{said[:LONGEST_SENTENCE]} ..."
    stderr.print(f"nlp-gait: {shown}", soft_wrap=True)


def say(sentence: str) -> None:
    """A sentence on stderr, beside what a command prints."""
    stderr.print(sentence, soft_wrap=True)


def print_json(data: Any) -> None:
    """One JSON object on stdout; what is not finite is null, because not every reader accepts NaN."""
    sys.stdout.write(json.dumps(replace_nan(data), indent=1, allow_nan=False) + "\n")


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Table on stdout, never wider than the terminal; numbers are right-aligned, but for the first column.

    What does not fit beside the first column follows in a second table with that column again; on narrow terminals there
    is a block of lines for each row.
    """
    if stdout.width <= STACKED_WIDTH and len(header) > 2:
        _print_stacked(title, header, rows)
        return
    header, rows = [harmless(name) for name in header], [[harmless(text) for text in row] for row in rows]
    needs = [_needed(name, [row[i] for row in rows]) for i, name in enumerate(header)]
    groups: list[list[int]] = [[0]]
    room = stdout.width - needs[0] - GAP - 1
    left = room
    for i in range(1, len(header)):
        if needs[i] + GAP > left and len(groups[-1]) > 1:
            groups.append([0])
            left = room
        groups[-1].append(i)
        left -= needs[i] + GAP
    for k, group in enumerate(groups):
        stdout.print(title if k == 0 else f"{title}, continued")
        table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, GAP - 1, 0, 0))
        for i in group:
            need = min(needs[i], room)
            justify: Literal["left", "right"] = "right" if i and all(_number(row[i]) for row in rows) else "left"
            flexible = any(len(row[i]) > LONGEST_CELL for row in rows)
            table.add_column(
                header[i], justify=justify, overflow="fold", min_width=need, width=None if flexible else need
            )
        for row in rows:
            table.add_row(*(row[i] for i in group))
        stdout.print(table)


def _number(text: str) -> bool:
    return len(text) <= LONGEST_CELL and (not text or text[0] in "+-.0123456789")


def _needed(name: str, column: Sequence[str]) -> int:
    """Width of a column whose heading is wrapped at spaces, and long cells too."""
    words = [name.split(), *([text] if len(text) <= LONGEST_CELL else text.split() for text in column)]
    return max((len(word) for line in words for word in line), default=1)


def _print_stacked(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    stdout.print(title)
    for row in rows:
        stdout.print(f"{header[0]} {row[0]}".strip())
        for name, text in zip(header[1:], row[1:], strict=True):
            stdout.print(f"  {name}: {text}")


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
        yield _Log(description, total)
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


class _Log:
    """Progress where there is no terminal: a line now and then, so that the log of long work is not empty."""

    def __init__(self, description: str, total: int | None) -> None:
        self.description, self.total, self.done = description, total, 0
        self.began = self.said = time.monotonic()

    def __call__(self, note: str) -> None:
        self.done += 1
        now = time.monotonic()
        if now - self.said >= LOG_PERIOD_S:
            self.said = now
            of = "" if self.total is None else f" of {self.total}"
            stderr.print(f"{self.description}: {self.done}{of} after {now - self.began:.0f} s; {note}", soft_wrap=True)


def output_file(path: Path) -> Path:
    """Path that can be written to, checked before the work."""
    check_name(path)
    make_writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
    except OSError as error:  # its name is too long
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    return path
