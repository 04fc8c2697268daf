"""Where numbers come from: settings and seeds of solvers, shipped best known values."""

import json
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from compare.analysis.best_known import compute_gap
from compare.analysis.record_statistics import find_best_known
from compare.analysis.units import format_percent, with_unit
from compare.report.document import Prose, Table, make_text_table
from compare.study.description import describe_solver, list_described_names
from compare.study.record import RunRecord
from compare.study.references import find_reference
from compare.study.task import GRADIENT_SOLVERS, IPOPT, describe_settings, list_solvers
from metaheuristics.errors import SearchError
from metaheuristics.registry import ALGORITHMS, make_algorithm
from nlp_gait.backends.identity import hash_json, make_key
from nlp_gait.backends.solvers.registry import make_solver
from nlp_gait.errors import GaitError

# The one explanation of each term: of a column by its heading, and in the glossary at the end of a page.
GLOSSARY = {
    "run": "one solver with one seed; a start of a gradient method is a run",
    "gap": "distance from the best known value, relative to it",
    "reached": "a gap of at most 1e-6, which is 0.0001 %",
    "feasible": "satisfies all constraints at the problem's samples, within the judge's tolerance",
    "guaranteed": "proven to satisfy all limits at every instant",
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
    groups: dict[tuple[str, str, str], list[RunRecord]] = {}
    for record in records:
        key = record.solver, format_settings(record.inputs.settings), describe_budget(record)
        groups.setdefault(key, []).append(record)
    rows = []
    for (solver, *_), group in groups.items():
        run = next((r for r in group if r.settings), group[0])  # a failed run has none
        seeds = f"{min(r.seed for r in group)} to {max(r.seed for r in group)}"
        title = describe_solver(solver).title if solver in list_described_names() else "-"
        counts = str(len(group)), str(len({r.problem for r in group}))
        rows.append((solver, *compare_with_defaults(run), seeds, *counts, title))
    return make_text_table(("solver", *SETTINGS, "seeds", "runs", "problems", "what"), rows, prose=True)


def make_reference_table(records: Iterable[RunRecord]) -> Table | str:
    """Return the best of the records next to the shipped best known value, a row for each problem that has one."""
    groups: dict[str, list[RunRecord]] = {}
    for record in records:
        groups.setdefault(hash_json(make_key(record.inputs.problem)), []).append(record)
    rows = []
    for group in groups.values():
        known, objective = find_reference(group[0].inputs.problem), group[0].inputs.objective
        best = find_best_known(group, objective)
        if known.objective is not None:
            gap = format_percent(compute_gap(best, known.objective, objective))
            values = (with_unit(value, objective.unit) for value in (best, known.objective))
            rows.append((group[0].problem, *values, gap, known.source))
    if not rows:
        return "No best known value is shipped for the settings of these runs; gaps are relative to the best of them."
    header = ("problem", "best of these runs", "best known", "gap", "source of the best known value")
    return make_text_table(header, rows, "Best known values", prose=True)


SETTINGS = ("evaluations allowed", "changed settings", "default settings")


def compare_with_defaults(record: RunRecord) -> tuple[str, str, str]:
    """Return a run's budget, its solver's settings that differ from the defaults, and the others, under ``SETTINGS``."""
    settings, defaults = dict(record.settings), _find_defaults(record)
    if defaults is None:
        return describe_budget(record), format_settings(settings) or "-", "unknown"
    handling = settings.pop("handling", None)
    if isinstance(handling, Mapping):
        settings["constraint handling"] = handling.get("kind") if handling.keys() == {"kind"} else handling
        defaults = {**defaults, "constraint handling": "Deb"}
    if record.inputs.polish:
        defaults = {**defaults, IPOPT: _load_defaults(IPOPT)}
    given = record.inputs.settings
    changed = {
        name: value
        for name, value in settings.items()
        if name in defaults
        and format_settings(value) != format_settings(defaults[name])  # a stored tuple is a list
        and (name in given or defaults[name] is not None)  # None: recorded as the solver chose it
    }
    texts = [
        f"{name}: {format_settings(value)} (default {format_settings(defaults[name])})"
        for name, value in changed.items()
    ]
    others = {name: value for name, value in settings.items() if name not in changed and name != "kind"}
    return describe_budget(record), ", ".join(texts) or "none", format_settings(others) or "-"


def describe_budget(record: RunRecord) -> str:
    """Return the number of evaluations that a run was allowed."""
    budget = record.inputs.stop.get("evaluations")
    return f"{budget:,}".replace(",", "\u202f") if budget else "no limit"


def _find_defaults(record: RunRecord) -> Mapping[str, Any] | None:
    """Return the default settings of a run's solver; None for user code and imported results."""
    solver: str | Mapping[str, Any] | None = record.inputs.solver
    if isinstance(solver, Mapping):  # settings of a search, by its class
        kind = solver.get("kind")
        solver = next((name for name in ALGORITHMS if _load_defaults(name).get("kind") == kind), None)
    known = isinstance(solver, str) and solver in list_solvers() and not record.inputs.imported
    return (_load_defaults(str(solver)) or None) if known else None


@cache
def _load_defaults(name: str) -> Mapping[str, Any]:
    try:
        return make_solver(name).to_dict() if name in GRADIENT_SOLVERS else describe_settings(make_algorithm(name))
    except (GaitError, SearchError):  # a package is not installed
        return {}


def format_settings(settings: object) -> str:
    """Return plain data on one line, without quotes."""
    return json.dumps(settings, sort_keys=True).replace('"', "").strip("{}")
