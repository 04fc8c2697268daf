"""Settings of a solver with defaults, meaning and source, from its docstring and the ``#:`` comments of its fields."""

import inspect
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from compare.study.run import list_solvers
from metaheuristics.multi_objective import FRONT_ALGORITHMS
from metaheuristics.registry import ADAPTERS, ALGORITHMS
from nlp_gait.backends.solvers.registry import SOLVERS

FIELD = re.compile(r"^    (\w+):")
SECTION = re.compile(r"^(Attributes|Args|Raises|Returns|Source):$")


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A setting: its name, its default as text, and its meaning."""

    name: str
    default: str
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Description:
    """A solver in words; ``source`` is empty if its docstring names none."""

    name: str
    title: str
    settings: tuple[Setting, ...]
    source: str


def list_described_names() -> tuple[str, ...]:
    """Return the names of all solvers of a study and of the algorithms for several objectives."""
    return (*list_solvers(), *FRONT_ALGORITHMS)


def describe_solver(name: str) -> Description:
    """Return the description of a solver by its name, as ``nlp-gait list`` shows it."""
    factory: Any = {**ALGORITHMS, **ADAPTERS, **FRONT_ALGORITHMS, **SOLVERS}[name]
    bound = factory.keywords if isinstance(factory, partial) else {}
    kind: Any = factory.func if isinstance(factory, partial) else factory
    # A class may inherit the documentation of its settings and its source.
    bases = list(reversed(kind.__mro__[:-1]))
    sections = {k: text for base in bases for k, text in _split_sections(base.__doc__ or "")}
    meanings = {name: text for base in bases for name, text in _read_fields(base)}
    parameters = inspect.signature(kind).parameters.values()
    settings = tuple(
        Setting(name=p.name, default="" if p.default is p.empty else str(p.default), meaning=meanings.get(p.name, ""))
        for p in parameters
        if p.name not in bound and p.kind is not p.VAR_KEYWORD
    )
    return Description(
        name=name,
        title=sections[""].split("\n")[0],
        settings=settings,
        source=" ".join(sections.get("Source", "").replace("``", "`").split()),
    )


def _split_sections(text: str) -> Iterator[tuple[str, str]]:
    """Yield the sections of a Google docstring with their headings; the first has none."""
    heading, lines = "", list[str]()
    for line in inspect.cleandoc(text).splitlines():
        if title := SECTION.match(line):
            yield heading, "\n".join(lines).strip("\n")
            heading, lines = title[1], []
        else:
            lines.append(line)
    yield heading, "\n".join(lines).strip("\n")


def _read_fields(kind: type) -> Iterator[tuple[str, str]]:
    """Yield the fields of a class with their ``#:`` comments, which stand before or behind them."""
    words: list[str] = []
    with suppress(OSError):  # a frozen program has no source
        for line in inspect.getsource(kind).splitlines():
            code, _, comment = line.partition("#: ")
            if comment:
                words.append(comment)
            if words and (field := FIELD.match(code)):
                yield field[1], " ".join(words).replace("``", "`")
            if code.strip():
                words = []
