"""What commands print: results, written files, progress, and the sentences with which they end."""

import json
import shlex
import sys
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, TypeVar

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from nlp_gait.files import replace_nan

T = TypeVar("T")

MOST_NAMED = 3  # written files; of more, the first one is named
LONGEST_CELL = 24  # characters of a word in a table that are not wrapped
LONGEST_SENTENCE = 2000  # characters of an error message, in which a value can be a whole file
LOG_PERIOD_S = 30.0  # between lines of progress in a log


class Rows(NamedTuple):
    """A table of texts."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, kw_only=True)
class Output:
    """What a command hands out."""

    data: Mapping[str, Any]  #: for --json
    parts: Sequence[str | Rows] = ()  #: sentences and tables for people
    written: Iterable[Path] = ()
    answer: Sequence[str] = ()  #: sentences that are printed last
    failures: Sequence[str] = ()  #: sentences by which the command ends with status 1
    interrupted: str = ""  #: the sentence after Ctrl-C, by which it ends with status 130


class PlainConsole(Console):
    """Console without markup, on which control characters are shown as escapes."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Render text, titles and cells of tables included."""
        return super().render_str(escape_controls(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; without a terminal, each sentence is one line, so that programs can search for it."""
        if not self.is_terminal and all(isinstance(item, str) for item in objects):
            options.setdefault("soft_wrap", True)
        super().print(*objects, **options)


def escape_controls(text: str) -> str:
    """Replace control and invalid characters by escapes; spaces of other widths, as between thousands, remain."""
    allowed = {sign for sign in text if sign in "\n\t" or sign.isprintable() or unicodedata.category(sign) == "Zs"}
    return "".join(sign if sign in allowed else repr(sign)[1:-1] for sign in text)


stderr = PlainConsole(stderr=True, highlight=False, markup=False)
stdout = PlainConsole(highlight=False, markup=False)  # 80 columns without a terminal


def say(sentence: str) -> None:
    """Print a sentence on stderr."""
    stderr.print(sentence, soft_wrap=True)


def say_error(message: str) -> None:
    """Print the sentence of an error on stderr."""
    text = " ".join(message.split())
    text = text if len(text) <= LONGEST_SENTENCE else f"{text[:LONGEST_SENTENCE]} ..."
    say(f"nlp-gait: {text}")


def fail(message: str, status: int = 1) -> NoReturn:
    """End with a status and one sentence."""
    say_error(message)
    raise typer.Exit(status)


def describe_command() -> str:
    """Return the command line of this process."""
    return shlex.join(["nlp-gait", *sys.argv[1:]])


def print_output(output: Output, as_json: bool) -> None:
    """Print results and written files: as one JSON object, or as sentences, tables and names of files."""
    written = [*output.written]
    if as_json:  # numbers that are not finite are null, as not every reader accepts NaN
        data = replace_nan({**output.data, "files": [str(path) for path in written]})
        sys.stdout.write(json.dumps(data, indent=1, allow_nan=False) + "\n")
        return
    for block in output.parts:
        if isinstance(block, str):
            stdout.print(block)
        else:
            print_table(*block)
    if written:
        unnamed = f" and {len(written) - 1} files" if len(written) > MOST_NAMED else ""
        for path in written[:1] if unnamed else written:
            stdout.print(f"wrote {path}{unnamed}", soft_wrap=True)
    for sentence in output.answer:
        stdout.print(sentence, soft_wrap=True)


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout, not wider than the terminal; numbers are right-aligned, except in the first column.

    A table whose columns do not fit has a block of lines per row.
    """
    stdout.print(title)
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for i, name in enumerate(header):
        texts = [row[i] for row in rows]
        is_number = i > 0 and all(not text or text[0] in "+-.0123456789" for text in texts)
        words = (word for text in (name, *texts) for word in text.split())
        width = min(max((len(word) for word in words), default=1), LONGEST_CELL)
        table.add_column(name, justify="right" if is_number else "left", overflow="fold", min_width=width)
    for row in rows:
        table.add_row(*row)
    if table.__rich_measure__(stdout, stdout.options).minimum <= stdout.width:
        stdout.print(table)
        return
    for row in rows:
        stdout.print(f"{header[0]} {row[0]}".strip(), soft_wrap=False)
        for name, text in zip(header[1:], row[1:], strict=True):
            stdout.print(f"  {name}: {text}", soft_wrap=False)


def tabulate(title: str, items: Iterable[T], columns: Mapping[str, Callable[[T], str]]) -> Rows:
    """Return a table with a row per item; columns map headings to functions of the item."""
    return Rows(title, list(columns), [[cell(item) for cell in columns.values()] for item in items])


@contextmanager
def show_progress(description: str, total: int | None) -> Iterator[Callable[..., None]]:
    """Show progress on stderr, of unknown length if total is None.

    The yielded function takes a note, whose lines are shown below the bar, and steps other than 1.
    """
    if not stderr.is_terminal:
        yield _ProgressLog(description, total)
        return
    from rich.console import Group
    from rich.live import Live
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    progress = Progress(*columns, console=stderr)
    task = progress.add_task(escape_controls(description), total=total)
    with Live(progress, console=stderr, transient=True) as live:

        def advance(note: str, steps: int = 1) -> None:
            progress.advance(task, steps)
            live.update(Group(progress, Text(escape_controls(note))))

        yield advance


class _ProgressLog:
    """Progress without a terminal: an occasional line for the log of long work."""

    def __init__(self, description: str, total: int | None) -> None:
        self.description, self.total, self.done = description, total, 0
        self.started = self.reported = time.monotonic()

    def __call__(self, note: str, steps: int = 1) -> None:
        self.done += steps
        now = time.monotonic()
        if now - self.reported >= LOG_PERIOD_S:
            self.reported = now
            of = "" if self.total is None else f" of {self.total}"
            lines = note.replace("\n", "; ")
            say(f"{self.description}: {self.done}{of} after {now - self.started:.0f} s; {lines}")
