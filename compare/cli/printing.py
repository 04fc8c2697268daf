"""What commands print: results, written files, progress, and the sentences with which they end."""

import json
import os
import shlex
import sys
import threading
import time
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from nlp_gait.files import replace_nan

MOST_NAMED = 3  # written files; of more, the first one is named
LONGEST_CELL = 24  # characters of a word in a table that are not wrapped
LONGEST_SENTENCE = 2000  # characters of an error message, in which a value can be a whole file
LOG_PERIOD_S = 5.0  # between lines of progress in a log
REFRESHED_PER_S = 5.0  # line of progress on a terminal
COLUMNS = 79  # of a line of progress, at most


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
    """Print a sentence on stderr, above a line of progress."""
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


class ProgressLine:
    """A line on a terminal that is rewritten; in a log, a line every few seconds."""

    def __init__(self, description: str, total: int | None = None, note: str = "") -> None:
        """Begin; ``total`` is None for work of unknown length."""
        self.description, self.total, self.note = description, total, note
        self.done = self.fresh = 0
        self.started = time.monotonic()

    def __call__(self, note: str, steps: int = 1) -> None:
        """Count a step and show its note; more steps than one were done by an earlier command."""
        if steps == 0:
            return
        self.done, self.note = self.done + steps, "; ".join(note.splitlines())
        self.fresh += steps == 1

    def describe(self) -> str:
        """Return for example ``runs 48 of 106, 31 s left, best gap 0.0046 % (nao-ssp, ACO)``."""
        seconds, counted = time.monotonic() - self.started, ""
        if self.total is not None or self.done:
            counted = f" {self.done:,}" + ("" if self.total is None else f" of {self.total:,}")
        left = format_duration(seconds)
        if self.total is not None and self.fresh:
            left = f"{format_duration(seconds / self.fresh * max(self.total - self.done, 0))} left"
        return escape_controls(", ".join(filter(None, (f"{self.description}{counted}", left, self.note))))

    def render(self) -> Text:
        """Return the line as the terminal shows it."""
        return Text(self.describe()[:COLUMNS], no_wrap=True, overflow="crop")


def format_duration(seconds: float) -> str:
    """Return for example ``31 s``, ``5 min`` or ``2.5 h``."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


_lines: list[ProgressLine] = []  # of this command, the one that is shown last


@contextmanager
def report_silence(command: str) -> Iterator[None]:
    """Say every few seconds what the command works on, where no line on a terminal shows it."""
    ended, own = threading.Event(), ProgressLine(f"{command} is at work")

    def speak() -> None:
        while not ended.wait(LOG_PERIOD_S):
            line = (_lines or [own])[-1]
            if line is own or not stderr.is_terminal:
                os.write(2, f"{line.describe()}\n".encode())  # a fork must not wait for a lock of the console

    threading.Thread(target=speak, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


@contextmanager
def show_progress(description: str, total: int | None = None, first: str = "") -> Iterator[ProgressLine]:
    """Show progress on stderr, of unknown length if total is None; ``first`` is the note before the first step.

    The yielded function takes a note, and steps other than 1 for what an earlier command did.
    """
    line = ProgressLine(description, total, first)
    _lines.append(line)
    try:
        with _show_live(line) if stderr.is_terminal else nullcontext():
            yield line
    finally:
        _lines.remove(line)


def _show_live(line: ProgressLine) -> AbstractContextManager[object]:
    from rich.live import Live

    return Live(
        get_renderable=line.render,
        console=stderr,
        transient=True,
        refresh_per_second=REFRESHED_PER_S,
        redirect_stdout=False,  # a fork must not wait for a lock of this display
        redirect_stderr=False,
    )
