"""Report of the reproduced stairs paper: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

from importlib import resources

from compare.papers.stairs.figures import all_figures
from compare.papers.stairs.tables import Findings, all_tables
from compare.report.document import Document
from compare.report.template import document_from


def document(findings: Findings) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.stairs") / "report.md").read_text(encoding="utf-8")
    effort = findings.effort
    values = {
        "plan_evaluations": effort.plan_evaluations,
        "track_evaluations": effort.track_evaluations,
        "network_case": effort.cases[0],
        "cases": " | ".join(f"case {case}" for case in effort.cases),
        "papers": " | ".join(f"paper {case}" for case in effort.cases),
        "ours": " | ".join(f"ours {case}" for case in effort.cases),
        "cases_4f": " | ".join(".4f" for _ in effort.cases),
        "cases_6g": " | ".join(".6g" for _ in effort.cases),
    }
    return document_from(text, values=values, tables=all_tables(findings), figures=all_figures(findings))
