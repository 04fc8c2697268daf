"""What an algorithm or solver can be told: settings with defaults, meaning and source, from its own docstring."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import metaheuristics
from compare.study.task import solver_names
from metaheuristics.multi_objective import FRONT_ALGORITHMS
from nlp_gait.backends.solvers.registry import SOLVERS

SECTION = re.compile(r"^(Attributes|Args|Raises|Returns|Source):$")
ENTRY = re.compile(r"^(\w+): (.*)$")


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting: its name, its default as text, and what it means."""

    name: str
    default: str
    words: str


@dataclass(frozen=True, kw_only=True)
class Description:
    """An algorithm or solver in words; ``source`` is empty where its docstring names none."""

    name: str
    title: str
    settings: tuple[Setting, ...]
    source: str


def described_names() -> tuple[str, ...]:
    """Names of all that has a description: what a study runs, and the algorithms for several objectives."""
    return (*solver_names(), *FRONT_ALGORITHMS)


def description_of(name: str) -> Description:
    """Of an algorithm or solver by its name, as ``nlp-gait list`` shows it."""
    factory: Any = {**metaheuristics.ALGORITHMS, **metaheuristics.ADAPTERS, **FRONT_ALGORITHMS, **SOLVERS}[name]
    bound = factory.keywords if isinstance(factory, partial) else {}
    kind: Any = factory.func if isinstance(factory, partial) else factory
    # A class may leave its settings and its source to the one that it extends.
    sections = {
        k: text for base in reversed(kind.__mro__[:-1]) for k, text in _sections(inspect.cleandoc(base.__doc__ or ""))
    }
    words = dict(_entries(sections.get("Attributes", "") or sections.get("Args", "")))
    parameters = inspect.signature(kind).parameters.values()
    settings = tuple(
        Setting(name=p.name, default="" if p.default is p.empty else str(p.default), words=words.get(p.name, ""))
        for p in parameters
        if p.name not in bound and p.kind is not p.VAR_KEYWORD
    )
    return Description(
        name=name,
        title=sections[""].split("\n")[0],
        settings=settings,
        source=" ".join(sections.get("Source", "").replace("``", "`").split()),
    )


def _sections(text: str) -> Iterator[tuple[str, str]]:
    """Parts of a Google docstring by their headings; what stands before the first has none."""
    heading, lines = "", list[str]()
    for line in text.splitlines():
        found = SECTION.match(line)
        if found:
            yield heading, "\n".join(lines).strip("\n")
            heading, lines = found[1], []
        else:
            lines.append(line)
    yield heading, "\n".join(lines).strip("\n")


def _entries(text: str) -> Iterator[tuple[str, str]]:
    """``name: words`` pairs, words over several lines joined."""
    for block in re.split(r"\n(?=\S)", inspect.cleandoc(text)):
        found = ENTRY.match(" ".join(block.split()))
        if found:
            yield found[1], found[2].rstrip(".").replace("``", "`")
