"""Report of the reproduced NAO paper: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import resources
from typing import Any

from compare.papers.nao.nao_figures import all_figures
from compare.papers.nao.nao_findings import NAMES, Findings, PhaseFindings
from compare.papers.nao.nao_runs import ALGORITHMS
from compare.papers.nao.nao_tables import all_tables
from compare.report.document import Document
from compare.report.template import fill_template


def document(findings: Findings) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.nao") / "nao_report.md").read_text(encoding="utf-8")
    return fill_template(
        text, values=_values(findings), tables=all_tables(findings), figures=dict(all_figures(findings))
    )


def _values(findings: Findings) -> dict[str, Any]:
    ssp, dsp = findings.phases
    runs = ssp.searches["pso"]
    solved = [start.verdict.objective for start in findings.lever if start.claimed]
    lever = f"{min(solved):.5f} W instead of {dsp.best:.5f} W" if solved else "no optimum"
    printed = [
        (optimum.power_W, phase.printed_here[name].objective, phase.printed_with_legs_twice[name])
        for phase in findings.phases
        for name, optimum in phase.paper.optima.items()
    ]
    return {
        "runs": len(runs),
        "generations": runs[0].iterations,
        "starts": len(ssp.starts),
        "robot": ssp.problem.options["robot"],
        "ssp": _phase(ssp),
        "dsp": _phase(dsp),
        "costs": _range(100 * (here.objective / dsp.best - 1) for here in dsp.printed_here.values()),
        "lever": f"{lever} ({len(solved)} of {len(findings.lever)} starts converged)",
        "gaps": _range(power - here for power, here, _ in printed),
        "misses": _range(100 * (twice / power - 1) for power, _, twice in printed),
    }


def _phase(phase: PhaseFindings) -> dict[str, Any]:
    """Numbers of one phase; ``broken`` counts final solutions that break a limit between the samples that the paper looks at."""
    ends = [run.verdict for runs in phase.searches.values() for run in runs if run.verdict.feasible]
    optimum = phase.optimum.verdict
    return {
        "converged": phase.converged,
        "medians": ", ".join(f"{phase.median_run(name)} of {NAMES[name]}" for name in ALGORITHMS),
        "feasible": len(ends),
        "broken": sum(end.dense_feasible is False for end in ends),
        "optimum": "does not" if optimum.dense_feasible else f"breaks {optimum.violated[0]}",
        "below": 100 * max(phase.share_below(i) for i in phase.sweeps),
    }


def _range(values: Iterable[float]) -> tuple[float, float]:
    known = list(values)
    return min(known), max(known)
