"""The report: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

from importlib import resources
from typing import Any

from compare.analysis.units import join_words
from compare.papers.nao.nao_claims import FAILS, HOLDS
from compare.papers.nao_pareto.nao_pareto_claims import NEAR, claims
from compare.papers.nao_pareto.nao_pareto_figures import all_figures
from compare.papers.nao_pareto.nao_pareto_findings import EVEN_POINTS, Findings, PhaseFindings
from compare.papers.nao_pareto.tables import all_tables
from compare.questions.pareto.search import REFERENCE
from compare.report.document import Document
from compare.report.template import fill_template


def document(findings: Findings) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.nao_pareto") / "nao_pareto_report.md").read_text(encoding="utf-8")
    return fill_template(text, values=_values(findings), tables=all_tables(findings), figures=all_figures(findings))


def _values(findings: Findings) -> dict[str, Any]:
    ssp, dsp = findings.phases
    effort, verdicts = findings.effort, [claim.verdict for claim in claims(findings)]
    return {
        "runs": effort.runs,
        "budgets": join_words(f"{budget:,}" for budget in effort.budgets),
        "largest": f"{effort.budgets[-1]:,}",
        "points": effort.points,
        "samples": effort.intervals + 1,
        "reference": REFERENCE,
        "even": EVEN_POINTS,
        "near": 100 * NEAR,
        "criterion": ssp.criterion.name,
        "claims": len(verdicts),
        "held": verdicts.count(HOLDS),
        "refuted": verdicts.count(FAILS),
        "robot": ssp.problem.options["robot"],
        "ssp": _phase(ssp),
        "dsp": _phase(dsp),
    }


def _phase(phase: PhaseFindings) -> dict[str, Any]:
    return {"variables": len(phase.problem.names), "knees": len(phase.bends.knees)}
