"""Commands: groups of options, and exit by errors.

Options of several commands form a group: a frozen dataclass whose fields are annotated like parameters of a Typer command. A
command with a parameter of that type has every field as an option, and receives the dataclass. Texts, flags and limits of options
are in ``options.toml``, except those that a program computes: these are annotated.
"""

import codecs
import errno
import functools
import inspect
import io
import os
import select
import sys
import tomllib
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_origin

import typer

from compare.cli.endings import end_interrupted, fail, say_error
from compare.cli.outputs import register_written
from metaheuristics.errors import SearchError
from nlp_gait.errors import GaitError
from nlp_gait.files import protect_inputs
from nlp_gait.interrupts import raise_interrupts

R = TypeVar("R")

PLAIN = "nlp-gait-plain"  # error handler for characters that an output cannot encode
# Parameters that name what a command writes.
OUTPUTS = ("out", "to", "table", "signals", "video")
FORCE = inspect.Parameter(
    "force",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, typer.Option("--force", help="Replace inputs and files of other programs, too.")],
)
# By command or group of options, and by parameter; "shared" has what several commands take.
TEXTS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    (files("compare.cli") / "options.toml").read_text(encoding="utf-8")
)
# Errors of the system if a file cannot grow.
NO_SPACE = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


def command(function: Callable[..., R]) -> Callable[..., R]:
    """Make a function a Typer command: groups become options, expected errors one sentence on stderr and an exit status."""
    parameters = inspect.signature(function, eval_str=True).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in parameters if is_dataclass(p.annotation)}

    @functools.wraps(function)
    def run(**given: Any) -> R:
        try:
            with raise_interrupts():
                protect_inputs(_find_inputs(given), given.pop("force", False))
                for name, group in groups.items():
                    given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
                with register_written():
                    result = function(**given)
                sys.stdout.flush()  # report a failed write here, not at the interpreter's exit
            return result
        except (GaitError, SearchError) as error:
            fail(str(error))
        except KeyboardInterrupt as interrupt:
            end_interrupted(str(interrupt) or "interrupted; all written files are complete")
        except OSError as error:
            _report_os_error(error)
            raise typer.Exit(1) from None

    options = list(_list_options(function, [function.__name__]))
    if any(option.name in OUTPUTS for option in options):
        options.append(FORCE)
    run.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in options}
    return run


def _find_inputs(given: Mapping[str, Any]) -> Iterator[Path]:
    """Yield the existing files that arguments name: alone, as the value of an option, or as the file of user code."""
    for name, value in given.items():
        for text in value if isinstance(value, (list, tuple)) else [value]:
            if name in OUTPUTS or not isinstance(text, (str, Path)):
                continue
            for part in (str(text), str(text).partition("=")[2], str(text).rpartition(":")[0]):
                with suppress(OSError, ValueError):  # a name that is too long, or none
                    if part and Path(part).is_file():
                        yield Path(part)


def _list_options(function: Callable[..., Any], owners: Sequence[str]) -> Iterator[inspect.Parameter]:
    """Yield the parameters of a function or group as options, described by the owners' texts; a group stands for its fields."""
    for parameter in inspect.signature(function, eval_str=True).parameters.values():
        kind = parameter.annotation
        if is_dataclass(kind) and isinstance(kind, type):
            yield from _list_options(kind, [base.__name__ for base in kind.__mro__])
        else:
            annotation = _annotate(kind, parameter.name, owners)
            yield parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=annotation)


def _annotate(annotation: Any, name: str, owners: Sequence[str]) -> Any:
    """Add the text, flags and limits of ``options.toml`` to the type of a parameter; the first owner that has them decides."""
    entry = next((TEXTS[owner][name] for owner in (*owners, "shared") if name in TEXTS.get(owner, ())), None)
    if entry is None or get_origin(annotation) is Annotated:
        return annotation
    described = {"help": entry} if isinstance(entry, str) else dict(entry)
    make = typer.Argument if described.pop("argument", False) else typer.Option
    return Annotated[annotation, make(*described.pop("flags", ()), **described)]


def run_app(app: Callable[[], object]) -> None:
    """Run the command line with outputs that accept all characters; report help that cannot be written."""
    _open_outputs()
    try:
        app()
    except OSError as error:
        _report_os_error(error)
        sys.exit(1)


def _report_os_error(error: OSError) -> None:
    """Report a failed write; nothing if the output's reader has ended, as with ``| head``. Raise other errors."""
    if error.errno not in (*NO_SPACE, errno.EPIPE):
        raise error
    closed = error.errno == errno.EPIPE and _is_output_closed()
    # Drop the buffers, so that the interpreter does not fail on them at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if error.errno != errno.EPIPE:
        say_error(f"cannot write the output: {error.strerror}")
    elif not closed:
        say_error("a child process exited unexpectedly")


def _is_output_closed() -> bool:
    outputs = select.poll()
    for stream in (sys.stdout, sys.stderr):
        outputs.register(stream.fileno(), select.POLLOUT)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in outputs.poll(0))


def _open_outputs() -> None:
    """Open the outputs and make them write every character, in ASCII where necessary.

    A closed standard output is rejected: the next file opened would get its descriptor and the printed text. A closed
    standard error is opened on the null device.
    """
    if sys.stderr is None:
        nothing = os.open(os.devnull, os.O_WRONLY)
        if nothing != 2:
            os.dup2(nothing, 2)
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
    if sys.stdout is None:
        sys.stdout = sys.stderr  # for the interpreter's exit
        say_error("standard output is closed; send it to a file or to /dev/null")
        sys.exit(1)
    codecs.register_error(PLAIN, _encode_plainly)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=PLAIN)


def _encode_plainly(error: UnicodeError) -> tuple[str, int]:
    """Return the nearest ASCII characters, such as a space for a narrow one, or else an escape."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    near = (unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() for sign in text)
    return "".join(found or ascii(sign)[1:-1] for found, sign in zip(near, text, strict=True)), error.end
