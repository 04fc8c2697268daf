"""What commands print: results, written files, progress, and the sentences with which they end."""

import json
import shlex
import sys
import threading
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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
LOG_PERIOD_S = 30.0  # between lines of progress in a log
FIRST_S, REWRITE_S = 1.0, 0.2  # until a line of progress on a terminal, and between its changes
COLUMNS = 79  # of a line of progress, at most
CLEAR = "\r\x1b[K"  # of the line of a terminal


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
shown: list["ProgressLine | None"] = [None]  # the line of progress on the terminal
stdout = PlainConsole(highlight=False, markup=False)  # 80 columns without a terminal


def say(sentence: str) -> None:
    """Print a sentence on stderr, in place of a line of progress, which is then written again."""
    if shown[0] is None:
        stderr.print(sentence, soft_wrap=True)
        return
    with shown[0].lock:
        shown[0].clear()
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
    """A line on a terminal that is rewritten, from the first second on; in a log, a line every half minute."""

    def __init__(self, description: str, total: int | None, on_terminal: bool) -> None:
        """Begin; ``total`` is None for work of unknown length."""
        self.description, self.total, self.on_terminal = description, total, on_terminal
        self.done = self.fresh = 0
        self.note = ""
        self.started = time.monotonic()
        self.next_s = FIRST_S if on_terminal else LOG_PERIOD_S
        self.lock, self.ended = threading.RLock(), threading.Event()

    def __call__(self, note: str, steps: int = 1) -> None:
        """Count a step and show its note; more steps than one were done by an earlier command."""
        if steps == 0:
            return
        self.done, self.note = self.done + steps, "; ".join(note.splitlines())
        self.fresh += steps == 1
        if not self.on_terminal:
            self.show()

    def describe(self) -> str:
        """Return for example ``runs 48 of 106, 31 s left, best gap 0.0046 % (nao-ssp, ACO)``."""
        seconds, of = time.monotonic() - self.started, "" if self.total is None else f" of {self.total:,}"
        left = format_duration(seconds)
        if self.total is not None and self.fresh:
            left = f"{format_duration(seconds / self.fresh * max(self.total - self.done, 0))} left"
        return escape_controls(", ".join(filter(None, (f"{self.description} {self.done:,}{of}", left, self.note))))

    def show(self) -> None:
        """Write the line if it is time for it."""
        with self.lock:
            if time.monotonic() - self.started < self.next_s or self.ended.is_set():
                return
            if not self.on_terminal:
                self.next_s += LOG_PERIOD_S
                say(self.describe())
                return
            stderr.file.write(CLEAR + self.describe()[: min(COLUMNS, stderr.width - 1)])
            stderr.file.flush()

    def clear(self) -> None:
        """Remove the line, before something else is printed."""
        if self.on_terminal:
            stderr.file.write(CLEAR)
            stderr.file.flush()

    def keep_showing(self) -> None:
        """Rewrite the line until the work ends."""
        while not self.ended.wait(REWRITE_S):
            self.show()


def format_duration(seconds: float) -> str:
    """Return for example ``31 s``, ``5 min`` or ``2.5 h``."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


@contextmanager
def show_progress(description: str, total: int | None, first: str = "") -> Iterator[Callable[..., None]]:
    """Show progress on stderr, of unknown length if total is None; ``first`` is the note before the first step.

    The yielded function takes a note, and steps other than 1 for what an earlier command did.
    """
    line = ProgressLine(description, total, stderr.is_terminal)
    line.note = first
    before, shown[0] = shown[0], line
    ticker = threading.Thread(target=line.keep_showing, daemon=True)
    if line.on_terminal:
        ticker.start()
    try:
        yield line
    finally:
        line.ended.set()
        shown[0] = before
        if line.on_terminal:
            ticker.join()
            line.clear()
