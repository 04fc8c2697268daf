"""Pages of the command line, generated from the commands' parsers."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer

from compare.cli import NAMES, PANELS, app
from docs.pages.markdown import code, literal, page, table, toctree, write_all

KINDS = {int: "INTEGER", float: "NUMBER", str: "TEXT", Path: "PATH"}  # of options without a name for their value
EXAMPLES = re.compile(r"^Examples?: (.*)\Z", re.DOTALL | re.MULTILINE)


def write(folder: Path) -> None:
    """Write an index and a page for each command."""
    group: Any = typer.main.get_command(app)
    names = {panel: [NAMES.get(f, f.__name__) for f in functions] for panel, functions in PANELS.items()}
    functions = {NAMES.get(f, f.__name__): f for functions in PANELS.values() for f in functions}
    pages = {f"{name}.md": _page(name, group.commands[name], function) for name, function in functions.items()}
    blocks = [
        "# Command line",
        "`nlp-gait COMMAND`. Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence "
        "says why), 2 wrong usage, 130 interrupted. `nlp-gait COMMAND --help` prints what stands here.",
    ]
    for panel, listed in names.items():
        rows = [(f"[`{name}`]({name}.md)", literal(_first_sentence(group.commands[name]))) for name in listed]
        blocks += [f"## {panel}", table(("command", "description"), rows)]
    blocks.append(toctree(name for listed in names.values() for name in listed))
    write_all(folder / "commands", {"index.md": page(*blocks), **pages})


def _first_sentence(command: Any) -> str:
    return inspect.cleandoc(command.help or "").split("\n")[0]


def _page(name: str, command: Any, function: Callable[..., Any]) -> str:
    words = inspect.cleandoc(command.help or "")
    found = EXAMPLES.search(words)
    examples = [] if found is None else re.findall(r"`([^`]+)`", found[1])
    prose = words if found is None else words[: found.start()]
    parameters = inspect.signature(function).parameters
    kinds = {name: _kind(parameter.annotation) for name, parameter in parameters.items()}
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option"]
    usage = " ".join(["nlp-gait", name, *(_metavar(a) for a in arguments), "[OPTIONS]"])
    return page(
        f"# nlp-gait {name}",
        *(literal(paragraph) for paragraph in prose.split("\n\n") if paragraph.strip()),
        f"```sh\n{usage}\n```",
        "**Examples**\n\n```sh\n" + "\n".join(examples) + "\n```" if examples else "",
        _table("Arguments", [(code(_metavar(a)), _help(a)) for a in arguments]),
        _table("Options", [(_flags(o, kinds.get(o.name, "")), _help(o)) for o in options]),
    )


def _table(title: str, rows: list[tuple[str, str]]) -> str:
    return f"## {title}\n\n{table(('name', 'what'), rows)}" if rows else ""


def _metavar(parameter: Any) -> str:
    shown = parameter.metavar or parameter.name.upper()
    return shown if parameter.required or shown.startswith("[") else f"[{shown}]"


def _flags(option: Any, kind: str) -> str:
    flags = ", ".join(code(flag) for flag in (*option.opts, *option.secondary_opts))
    return flags if option.is_flag else f"{flags} {code(option.metavar or kind)}".strip()


def _kind(annotation: Any) -> str:
    """Return the type of an option from the annotation of its parameter: ``Annotated[int | None, ...]``."""
    hint = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return next((KINDS[kind] for kind in (hint, *get_args(hint)) if kind in KINDS), "")


def _help(parameter: Any) -> str:
    words = literal(parameter.help or "")
    default = parameter.default
    if parameter.required and parameter.param_type_name == "option":
        return f"{words} Required."
    if default is None or callable(default) or default is False or default == () or "efault:" in words:
        return words
    return f"{words} Default: {code(str(default))}."
