"""Where numbers come from: terms, seeds and settings of solvers; these from docstrings and the ``#:`` comments of fields."""

import inspect
import json
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from compare.report.document import Prose, Table, make_text_table
from compare.study.record import RunRecord, group_by
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


# The one explanation of each term: of a column by its heading, and in the glossary at the end of a page.
GLOSSARY = {
    "run": "one solver with one seed; a start of a gradient method is a run",
    "gap": "distance from the best known value, relative to it",
    "reached": "a gap of at most 1e-6, which is 0.0001 %",
    "feasible": "satisfies all constraints of the problem within the judge's tolerance",
    "evaluations": "equivalent ones: the objective with all constraints at one point counts 1; for n variables a gradient or "
    "a Jacobian counts n + 1, a Hessian (n + 1)(n + 2)/2, like finite differences",
    "constraint": "one value between a lower and an upper bound; the bounds of the variables are not counted",
    "price": "change of the optimal objective per unit by which a bound is raised",
}
TERMS = Prose("*Terms.* " + ". ".join(f"**{term.capitalize()}**: {words}" for term, words in GLOSSARY.items()) + ".")


def explain(heading: str) -> str:
    """Return the glossary's words for the term that a heading contains; empty for none."""
    return next((words for term, words in GLOSSARY.items() if term in heading.split()), "")


def make_solver_table(records: Iterable[RunRecord]) -> Table:
    """Return settings, budget and seeds of the solvers of all records, a row for each difference."""
    groups = group_by(records, lambda r: (r.solver, format_settings(r.inputs.settings), describe_budget(r)))
    rows = []
    for (solver, *_), group in groups.items():
        run = next((r for r in group if r.settings), group[0])  # a failed run has none
        seeds = f"{min(r.seed for r in group)} to {max(r.seed for r in group)}"
        title = describe_solver(solver).title if solver in list_described_names() else "-"
        counts = str(len(group)), str(len({r.problem for r in group}))
        given, used = (format_settings(settings) or "-" for settings in (run.inputs.settings, run.settings))
        rows.append((solver, describe_budget(run), given, used, seeds, *counts, title))
    header = ("solver", "evaluations allowed", "given settings", "all settings", "seeds", "runs", "problems", "what")
    return make_text_table(header, rows, prose=True)


def describe_budget(record: RunRecord) -> str:
    """Return the number of evaluations that a run was allowed."""
    budget = record.inputs.evaluations
    return f"{budget:,}".replace(",", "\u202f") if budget else "no limit"


def format_settings(settings: object) -> str:
    """Return plain data on one line, without quotes."""
    return json.dumps(settings, sort_keys=True).replace('"', "").strip("{}")
