"""Where numbers come from: terms, settings and seeds of solvers."""

import json
from collections.abc import Iterable

from compare.report.document import Prose, Table, make_text_table
from compare.study.description import describe_solver, list_described_names
from compare.study.record import RunRecord, group_by

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
