"""Commands: groups of options, printed results, and exit by errors.

Options of several commands form a group: a frozen dataclass whose fields are annotated like parameters of a Typer command. A
command with a parameter of that type has every field as an option, and receives the dataclass. The texts of options are in
``help.toml``.
"""

import errno
import functools
import inspect
import io
import itertools
import json
import math
import os
import shlex
import sys
import threading
import time
import tomllib
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from copy import copy
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, NamedTuple, NoReturn, get_args

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text
from typer.models import ParameterInfo

from nlp_gait.decoding import find_groups, list_options, pack_options, replace_signature
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import check_output, replace_nan
from nlp_gait.interrupts import raise_interrupts

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


# In the annotation of a parameter that names the folder, or the file, that the command writes.
OUTPUT, OUTPUT_FILE = "output", "output file"
FORCE = "Replace files that exist."
CONTINUE = "rerun the same command to continue"


def _add_flag(name: str, flag: str, words: str) -> inspect.Parameter:
    annotation = Annotated[bool, typer.Option(flag, help=words)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation)


CONTEXT = inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)
JSON = _add_flag("as_json", "--json", "Print one JSON object.")
# Errors of the system if a file cannot grow.
NO_SPACE = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


def command(function: Callable[..., Output]) -> Callable[..., None]:
    """Make a function a Typer command: groups become options, and its output is printed; expected errors are one sentence."""
    options = [*(_add_help(function.__name__, option) for option in list_options(function).values()), JSON]
    outputs = [option.name for option in options if OUTPUT_FILE in get_marks(option)]
    if outputs:
        options.append(_add_flag("force", "--force", FORCE))
    groups = find_groups(function)

    @functools.wraps(function)
    def run(**given: Any) -> None:
        as_json, context = given.pop("as_json"), given.pop("context")
        try:
            with raise_interrupts(), report_silence(f"nlp-gait {context.info_name}"):
                _check_values(context, given)
                force = given.pop("force", False) if outputs else False
                for name in outputs:
                    if given[name] is not None:
                        check_output(given[name], force)
                output = function(**pack_options(groups, given))
                print_output(output, as_json)
                sys.stdout.flush()  # report a failed write here, not at the interpreter's exit
            for sentence in output.failures:
                say_error(sentence)
            if output.interrupted:
                fail(output.interrupted, status=130)
            if output.failures:
                raise typer.Exit(1)
        except GaitError as error:
            fail(str(error))
        except KeyboardInterrupt as interrupt:
            fail(str(interrupt) or "interrupted; all written files are complete", status=130)
        except OSError as error:
            _report_os_error(error)
        except Exception as error:
            searches = sys.modules.get("metaheuristics.errors")  # imports NumPy, which some commands do without
            if searches is None or not isinstance(error, searches.SearchError):
                raise
            fail(str(error))

    replace_signature(run, [*options, CONTEXT])
    return run


@cache
def read_help() -> Mapping[str, Mapping[str, str]]:
    """Return the texts of options by name, for each command's function, and under ``shared``."""
    return tomllib.loads(files("compare.cli").joinpath("help.toml").read_text(encoding="utf-8"))


def _add_help(function: str, option: inspect.Parameter) -> inspect.Parameter:
    """Make an option keyword-only and add its text."""
    text = read_help().get(function, {}).get(option.name) or read_help()["shared"].get(option.name)
    marks = list(getattr(option.annotation, "__metadata__", ()))
    infos = [copy(mark) for mark in marks if isinstance(mark, ParameterInfo)] or [typer.Option()]
    if text is not None and infos[0].help is None:
        infos[0].help = text
        kind = get_args(option.annotation)[0] if marks else option.annotation
        rest = [mark for mark in marks if not isinstance(mark, ParameterInfo)]
        option = option.replace(annotation=Annotated[kind, infos[0], *rest])
    return option.replace(kind=inspect.Parameter.KEYWORD_ONLY)


def _check_values(context: typer.Context, given: Mapping[str, Any]) -> None:
    """Raise InputError for an option that is NaN, which is within every range, or an empty text, which is no value."""
    for name, value in given.items():
        if isinstance(value, float) and math.isnan(value):
            raise InputError(f"--{name.replace('_', '-')} must be a finite number, got nan")
        source = context.get_parameter_source(name)
        texts = value if isinstance(value, (list, tuple)) else [value]
        is_empty = any(isinstance(text, str) and not text.strip() for text in texts)
        if source is None or source.name != "COMMANDLINE" or not (is_empty or value == Path()):
            continue
        option = next(parameter.opts[0] for parameter in context.command.params if parameter.name == name)
        if is_empty or _is_typed_empty(option):
            raise InputError(f"{option} is an empty text; give a value, or leave it out (is a shell variable not set?)")


def _is_typed_empty(option: str) -> bool:
    """Return whether an option or argument was typed as an empty text: a path is then parsed as the current folder."""
    words = sys.argv[1:]
    if not option.startswith("-"):
        return "" in words
    return f"{option}=" in words or (option, "") in itertools.pairwise(words)


@contextmanager
def report_interrupts(sentence: str = "interrupted; nothing was written") -> Iterator[None]:
    """Let Ctrl-C inside end the command with this sentence."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt(sentence) from interrupt


def describe_stored(folder: Path) -> str:
    """Return how many results are stored in a folder, and how to continue."""
    finished = sum(1 for files in ("store/**/*.json", "records/*/*.json") for _ in folder.glob(files))
    return f"{finished} finished results are stored in {folder}; {CONTINUE}"


def get_marks(option: inspect.Parameter) -> set[object]:
    """Return the marks in the annotation of an option."""
    return {mark for mark in getattr(option.annotation, "__metadata__", ()) if isinstance(mark, str)}


def run_app(app: Callable[[], object]) -> None:
    """Run the command line; characters that an output cannot encode become question marks."""
    if sys.stdout is None:  # its descriptor would be that of the next file
        sys.exit("nlp-gait: standard output is closed; send it to a file or to /dev/null")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        app()
    except OSError as error:
        _report_os_error(error)


def _report_os_error(error: OSError) -> NoReturn:
    """End with status 1: with a sentence if there is no space, silently if the output has no reader, as with ``| head``."""
    if error.errno not in (*NO_SPACE, errno.EPIPE):
        raise error
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is still buffered
    if error.errno != errno.EPIPE:
        say_error(f"cannot write the output: {error.strerror}")
    sys.exit(1)
