"""Pages of the command line, generated from the commands' parsers."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from compare.cli import PANELS, load_command
from docs.pages.markdown import code, literal, page, table, toctree, write_all

KINDS = {int: "INTEGER", float: "NUMBER", str: "TEXT", Path: "PATH"}  # of options without a name for their value
EXAMPLES = re.compile(r"^Examples?: (.*)\Z", re.DOTALL | re.MULTILINE)


def write(folder: Path) -> None:
    """Write an index and a page for each command."""
    names = [name for commands in PANELS.values() for name in commands]
    pages = {f"{name}.md": _page(name, load_command(name)) for name in names}
    blocks = [
        "# Command line",
        "`nlp-gait COMMAND`. Results go to stdout, progress and errors to stderr. Exit status: 0 done, 1 not done (one sentence "
        "says why), 2 wrong usage, 130 interrupted. `nlp-gait COMMAND --help` prints what stands here.",
    ]
    for panel, commands in PANELS.items():
        rows = [(f"[`{name}`]({name}.md)", literal(_first_sentence(load_command(name)))) for name in commands]
        blocks += [f"## {panel}", table(("command", "description"), rows)]
    blocks.append(toctree(names))
    write_all(folder / "commands", {"index.md": page(*blocks), **pages})


def _first_sentence(command: Any) -> str:
    return inspect.cleandoc(command.help or "").split("\n")[0]


def _page(name: str, command: Any) -> str:
    words = inspect.cleandoc(command.help or "")
    found = EXAMPLES.search(words)
    examples = [] if found is None else re.findall(r"`([^`]+)`", found[1])
    prose = words if found is None else words[: found.start()]
    parameters = inspect.signature(command.callback).parameters
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
