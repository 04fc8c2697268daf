"""Reference of every public name, each described once, from its docstring and types."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from docs.pages.markdown import write_all

# Packages and modules with public names; a name is described at its first occurrence.
DOORS = {
    "nlp_gait": (),
    "nlp_gait.formulation": (),
    "nlp_gait.formulation.solution": ("ActiveConstraint", "ConstraintValue", "Evaluations", "Outcome", "SolveTime"),
    "nlp_gait.limits": (),
    "nlp_gait.robots": (),
    "nlp_gait.gaitbench": (),
    "nlp_gait.simulation.plan": ("Plan", "make_plan"),
    "nlp_gait.simulation.drive": ("Drive",),
    "nlp_gait.simulation.simulate": ("Simulation", "simulate_plan"),
    "nlp_gait.simulation.measurements": ("Measurements", "average_pressure", "measure"),
    "nlp_gait.simulation.objective": ("Arena", "EngineObjective", "GaitScore"),
    "nlp_gait.export.formats": ("FORMATS", "write_as"),
    "metaheuristics": (),
    "metaheuristics.multi_objective": ("ManyObjectives", "Snapshot", "make_front_algorithm", "minimize_many"),
    "compare": (),
    "compare.study.run": ("ProblemSpec", "Run", "plan_runs"),
    "compare.study.study": ("Study", "run_study", "read_records"),
    "compare.study.record": ("History", "RunRecord", "Times", "make_frame"),
    "compare.questions.question": ("Answer", "Question", "Work", "find"),
    "compare.questions.sweep": ("Axis", "Sweep", "SweepPoint", "parse_axis"),
    "compare.questions.pareto.front": ("FrontPoint", "make_competing_objective", "solve_front"),
    "compare.study.import_runs": ("import_runs",),
    "compare.analysis.comparison": ("Comparison", "SolverRuns", "compare_problems"),
    "compare.analysis.columns": ("Column", "format_rows", "summarise"),
    "compare.analysis.record_statistics": ("approximate_rank_sum",),
    "compare.papers.paper": ("DifferenceRow", "Paper"),
    "compare.papers.paper_runs": (
        *("Effort", "Runner", "choose_best", "evaluate_point", "make_computation", "make_search_tasks"),
        *("make_start_tasks", "tabulate"),
    ),
    "compare.papers.rules": ("Alternatives", "Found"),
    "compare.report": (),
    "compare.report.document": ("Document", "Figure", "Prose", "Section", "Table", "make_text_table"),
    "compare.report.writing": ("render_markdown", "write_document"),
}
ORDER = ("function", "class", "exception", "data")  # on a page; within each as the module lists them
CODE = re.compile(r"(``.+?``)")
SPECIAL = re.compile(r"([*|`]|(?<=\w)_(?!\w))")


def names_of(door: str) -> tuple[str, ...]:
    """Return the public names of a module."""
    return tuple(DOORS[door] or importlib.import_module(door).__all__)


def write(folder: Path) -> None:
    """Write an index and a page for each module."""
    pages: dict[str, str] = {}
    described: dict[tuple[int, str], str] = {}
    for door in DOORS:
        module = importlib.import_module(door)
        blocks = [_heading(door, "="), inspect.getdoc(module) or ""]
        blocks[1] = "\n".join(_escaped(blocks[1].splitlines()))
        for name in sorted(names_of(door), key=lambda name: ORDER.index(_kind(getattr(module, name)))):
            value = getattr(module, name)
            key, full = (id(value), name), f"{door}.{name}"
            blocks.append(_heading(name, "-"))
            if key in described:
                blocks.append(f"The same as :py:obj:`{described[key]}`.")
                continue
            described[key] = full
            blocks.append(_directive(value, full))
        pages[f"{door}.rst"] = "\n\n".join(blocks) + "\n"
    tree = [".. toctree::", "   :maxdepth: 1", "", *(f"   {door}" for door in DOORS)]
    words = "Every public name, by the module that it is imported from. Other names may change without notice."
    pages["index.rst"] = "\n\n".join([_heading("Names in Python", "="), words, "\n".join(tree)]) + "\n"
    write_all(folder / "api", pages)


def _heading(title: str, line: str) -> str:
    return f"{title}\n{line * len(title)}"


def _kind(value: Any) -> str:
    if isinstance(value, type):
        return "exception" if issubclass(value, BaseException) else "class"
    return "function" if inspect.isroutine(value) else "data"


def _directive(value: Any, full: str) -> str:
    kind = _kind(value)
    if kind == "data":
        words = f"By name: {', '.join(value)}." if isinstance(value, Mapping) else f"``{_alias(value)}``"
        return f".. py:data:: {full}\n\n   {words}"
    members = ["   :members:", "   :show-inheritance:"] if kind == "class" else []
    return "\n".join([f".. auto{kind}:: {full}", *members])


def _alias(value: Any) -> str:
    """Return a constant, or the meaning of a type alias, without module names."""
    return re.sub(r"\b(?:\w+\.)+(?=\w)", "", str(value))


def linked(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Escape docstrings, plain text with code in double backticks, for reStructuredText."""
    lines[:] = _escaped(lines)


def _escaped(lines: list[str]) -> list[str]:
    found, literal = [], None  # indentation of the paragraph that a literal block follows
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if literal is not None and line.strip() and indent <= literal:
            literal = None
        if literal is None:
            parts = CODE.split(line)
            line = "".join(SPECIAL.sub(r"\\\1", part) if k % 2 == 0 else part for k, part in enumerate(parts))
            if line.rstrip().endswith("::"):
                literal = indent
        found.append(line)
    return found
