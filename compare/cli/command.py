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
import math
import os
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, NoReturn, get_args

import typer
from typer.models import ParameterInfo

from compare.cli.printing import Output, fail, print_output, report_silence, say_error
from nlp_gait.decoding import find_groups, list_options, pack_options, replace_signature
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import check_output
from nlp_gait.interrupts import raise_interrupts

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
