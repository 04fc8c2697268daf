"""A command: its groups of options, and how its errors end it.

Several commands take the same options. Such a group is a frozen dataclass whose fields are annotated as the parameters of a Typer
command are; a command that has a parameter of that type gets every field as an option, and the dataclass when it is called.
"""

from __future__ import annotations

import codecs
import errno
import functools
import inspect
import io
import os
import select
import sys
import unicodedata
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar, get_type_hints

import typer

from compare.cli.common import end_interrupted, fail, say_error
from metaheuristics.errors import SearchError
from nlp_gait.errors import GaitError
from nlp_gait.interrupts import raise_interrupts

R = TypeVar("R")

PLAIN = "nlp-gait-plain"  # how characters are written that an output's encoding does not have
# Errors of the system where a file cannot grow.
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


def command(function: Callable[..., R]) -> Callable[..., R]:
    """Function that Typer can call: groups become options, expected errors one sentence on stderr and the right status."""
    parameters = inspect.signature(function, eval_str=True).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in parameters if is_dataclass(p.annotation)}

    @functools.wraps(function)
    def run(**given: Any) -> R:
        try:
            with raise_interrupts():
                for name, group in groups.items():
                    given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
                result = function(**given)
                sys.stdout.flush()  # a failure to write is reported here, not by the interpreter at its end
            return result
        except (GaitError, SearchError) as error:
            fail(str(error))
        except KeyboardInterrupt as interrupt:
            end_interrupted(str(interrupt) or "interrupted; files that were written are whole")
        except OSError as error:
            _say(error)
            raise typer.Exit(1) from None

    options: list[inspect.Parameter] = []
    for parameter in parameters:
        alone = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)]
        options += _options(groups[parameter.name]) if parameter.name in groups else alone
    run.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in options}
    return run


def _options(group: Any) -> Iterator[inspect.Parameter]:
    """A parameter for each field of a group, in their order."""
    hints = get_type_hints(group, include_extras=True)
    for field in fields(group):
        default = inspect.Parameter.empty if field.default is MISSING else field.default
        yield inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hints[field.name]
        )


def run_app(app: Callable[[], object]) -> None:
    """Run the command line with outputs that take whatever it prints; help that cannot be written is said too."""
    _open_outputs()
    try:
        app()
    except OSError as error:
        _say(error)
        sys.exit(1)


def _say(error: OSError) -> None:
    """The sentence for what could not be written; none where the output's reader has gone, as with ``| head``.

    Raises:
        OSError: it is another one.
    """
    if error.errno not in (*NO_ROOM, errno.EPIPE):
        raise error
    gone = error.errno == errno.EPIPE and _readers_gone()
    # What is left in the buffers is dropped, so that the interpreter does not fail on it at its end.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if error.errno != errno.EPIPE:
        say_error(f"cannot write the output: {error.strerror}")
    elif not gone:
        say_error("a process that this one began has ended before its time")


def _readers_gone() -> bool:
    """Whether an output is a pipe that nobody reads any more."""
    outputs = select.poll()
    for stream in (sys.stdout, sys.stderr):
        outputs.register(stream.fileno(), select.POLLOUT)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in outputs.poll(0))


def _open_outputs() -> None:
    """Outputs that are open and write every character, as plainly as their encoding needs.

    A closed standard output is refused: the next file opened would take its place, and whatever is printed would go there. A
    closed standard error is opened on nothing.
    """
    if sys.stderr is None:
        nothing = os.open(os.devnull, os.O_WRONLY)
        if nothing != 2:
            os.dup2(nothing, 2)
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
    if sys.stdout is None:
        sys.stdout = sys.stderr  # for the interpreter's end
        say_error("standard output is closed; send it to a file or to /dev/null")
        sys.exit(1)
    codecs.register_error(PLAIN, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=PLAIN)


def _plain(error: UnicodeError) -> tuple[str, int]:
    """The nearest ASCII of what cannot be encoded, as a space for a narrow one; else its escape."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    near = (unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode() for sign in text)
    return "".join(found or ascii(sign)[1:-1] for found, sign in zip(near, text, strict=True)), error.end
