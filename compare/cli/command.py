"""A command: its groups of options, and how its errors end it.

Several commands take the same options. Such a group is a frozen dataclass whose fields are annotated as the parameters of a Typer
command are; a command that has a parameter of that type gets every field as an option, and the dataclass when it is called.
"""

from __future__ import annotations

import errno
import functools
import inspect
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar, get_type_hints

import typer

from compare.cli.common import end_interrupted, fail
from metaheuristics import SearchError
from nlp_gait.errors import GaitError

R = TypeVar("R")

# Errors of the system where a file cannot grow.
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)


def command(function: Callable[..., R]) -> Callable[..., R]:
    """Function that Typer can call: groups become options, expected errors one sentence on stderr and the right status."""
    parameters = inspect.signature(function, eval_str=True).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in parameters if is_dataclass(p.annotation)}

    @functools.wraps(function)
    def run(**given: Any) -> R:
        try:
            for name, group in groups.items():
                given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
            result = function(**given)
            sys.stdout.flush()  # a failure to write is reported here, not by the interpreter at its end
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


def _close_output() -> None:
    """Drop what is left in the buffers, so that the interpreter does not fail on it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
