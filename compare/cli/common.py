"""What the commands share: options that name a problem, progress, output and errors."""

from __future__ import annotations

import errno
import functools
import inspect
import json
import os
import sys
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, NoReturn, ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from compare.study.task import ProblemSpec
from metaheuristics import SearchError
from nlp_gait.errors import GaitError, InputError, OutputError, kind_name, unknown
from nlp_gait.files import without_nan
from nlp_gait.problem.registry import problem_maker

P = ParamSpec("P")
R = TypeVar("R")

ProblemName = Annotated[str, typer.Argument(metavar="PROBLEM", help="For example nao-ssp; see `nlp-gait list`.")]
Robot = Annotated[str | None, typer.Option(help="nao-v5 (default), nao-v6, nao-v4, or a robot file (.json, .urdf).")]
Intervals = Annotated[int | None, typer.Option(help="Equal parts of the phase (default 10).")]
Derivatives = Annotated[str | None, typer.Option(help="analytic (default) or finite-difference.")]
Options = Annotated[
    list[str] | None, typer.Option("--option", metavar="NAME=VALUE", help="Any other option of the problem.")
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="NAME=VALUE", help="Parameter, or a variable's bound as NAME.lower=VALUE; repeatable."
    ),
]
Fix = Annotated[
    list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a variable at a value; repeatable.")
]
ResultFile = Annotated[
    Path, typer.Argument(metavar="RESULT.json", help="From `solve --out`, a study's record, or written by hand.")
]
Seed = Annotated[int, typer.Option(min=0, help="Same seed, same result; run k uses seed + k.")]
Jobs = Annotated[int | None, typer.Option(min=1, max=4096, help="Worker processes (default: all processors).")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]

# What the system says where output cannot grow.
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)
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
    """Text whose control characters, and what is no character at all, stand as escapes."""
    shown = (sign if sign in "\n\t" or _is_shown(sign) else repr(sign)[1:-1] for sign in text)
    return "".join(shown)


def _is_shown(sign: str) -> bool:
    """Printable, or a space of another width, as between thousands."""
    return sign.isprintable() or unicodedata.category(sign) == "Zs"


stderr = PlainConsole(stderr=True, highlight=False, markup=False)
stdout = PlainConsole(highlight=False, markup=False, width=None if sys.stdout.isatty() else PIPE_WIDTH)


def command(function: Callable[P, R]) -> Callable[P, R]:
    """Turn expected errors into one sentence on stderr and the right exit status."""

    @functools.wraps(function)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            result = function(*args, **kwargs)
            sys.stdout.flush()  # what cannot be written is said here, not by the interpreter at its end
            return result
        except (GaitError, SearchError) as error:
            fail(str(error))
        except KeyboardInterrupt as interrupt:
            end_interrupted(str(interrupt) or "interrupted")
        except BrokenPipeError:  # the reader of our output has gone, for example `| head`
            _close_output()
            raise typer.Exit(1) from None
        except OSError as error:
            if error.errno not in NO_ROOM:
                raise
            _close_output()
            fail(f"cannot write the output: {error.strerror}")

    return run


def _close_output() -> None:
    """What is left in the buffers goes nowhere, so that the interpreter does not fail on it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def end_interrupted(sentence: str) -> NoReturn:
    """End with status 130 and one sentence that says what was kept."""
    stderr.print(f"nlp-gait: {sentence}", soft_wrap=True)
    raise typer.Exit(130)


def fail(message: str) -> NoReturn:
    """End with status 1 and one sentence."""
    said = " ".join(message.split())
    stderr.print(
        f"nlp-gait: {said if len(said) <= LONGEST_SENTENCE else said[:LONGEST_SENTENCE] + ' ...'}", soft_wrap=True
    )
    raise typer.Exit(1)


def problem_spec(
    name: str,
    robot: str | None,
    intervals: int | None,
    derivatives: str | None,
    options: Sequence[str] | None,
    values: Sequence[str] | None,
    fix: Sequence[str] | None = None,
) -> ProblemSpec:
    """Problem of a command line, checked.

    Raises:
        UnknownNameError: problem, option, parameter or variable.
        InputError: a value that is not allowed.
    """
    named = {"robot": robot, "intervals": intervals, "derivatives": derivatives}
    given: dict[str, Any] = {key: value for key, value in named.items() if value is not None}
    known = inspect.signature(problem_maker(name)).parameters
    for key, text in _pairs(options, "--option"):
        if key not in known:
            raise unknown(f"option of {name}", key, known)
        given[key] = _typed(key, text, known[key].default)
    settings = {key: _number(key, text, "--set") for key, text in _pairs(values, "--set")}
    spec = ProblemSpec(name=name, options=given, values=settings)
    problem = spec.load()
    fixed = problem.fix(**{key: _number(key, text, "--fix") for key, text in _pairs(fix, "--fix")})
    return ProblemSpec(name=name, options=given, values=dict(fixed.values))


def parse_numbers(text: str) -> list[float]:
    """Comma-separated numbers."""
    return [_number("x", part, "--x") for part in text.split(",")]


def quantity(value: float, unit: str, digits: str = ".6f") -> str:
    """Number with its unit; a pure number has none."""
    return f"{value:{digits}}" + ("" if unit == "1" else f" {unit}")


def print_json(data: Any) -> None:
    """One JSON object on stdout; what is not finite is null, for not every reader takes NaN."""
    sys.stdout.write(json.dumps(without_nan(data), indent=1, allow_nan=False) + "\n")


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Table on stdout; the first column is left-aligned."""
    table = Table(title=title, title_justify="left")
    for i, name in enumerate(header):
        table.add_column(name, justify="left" if i == 0 else "right", overflow="fold")
    for row in rows:
        table.add_row(*row)
    stdout.print(table)


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
    from nlp_gait.files import writable_folder

    writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
    except OSError as error:  # its name is too long
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    return path


def _pairs(items: Sequence[str] | None, flag: str) -> list[tuple[str, str]]:
    pairs = []
    for item in items or ():
        name, equals, text = item.partition("=")
        if not equals or not name:
            raise InputError(f"{flag} takes NAME=VALUE, got {item!r}")
        pairs.append((name.strip(), text.strip()))
    return pairs


def _number(name: str, text: str, flag: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{flag}: {name} must be a number, got {text!r}") from None


def _typed(name: str, text: str, default: Any) -> str | int | float | bool:
    """Text as the type of an option's default."""
    if isinstance(default, bool):
        if text.lower() not in ("true", "false"):
            raise InputError(f"--option {name} must be true or false, got {text!r}")
        return text.lower() == "true"
    if isinstance(default, (int, float)):
        try:
            return type(default)(text)
        except ValueError:
            raise InputError(f"--option {name} must be {kind_name(type(default))}, got {text!r}") from None
    return text
