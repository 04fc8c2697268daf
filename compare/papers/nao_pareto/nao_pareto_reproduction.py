"""Gupta, Pratihar, Deb (2025), as far as the abstract says: four searches on power against stability, and its claims."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

from compare.analysis.units import join_words
from compare.papers.nao_pareto import nao_pareto_runs
from compare.papers.nao_pareto.nao_pareto_claims import NEAR, check_claims
from compare.papers.nao_pareto.nao_pareto_figures import draw_figures
from compare.papers.nao_pareto.nao_pareto_findings import EVEN_POINTS, ParetoFindings, PhaseFindings, collect_points
from compare.papers.nao_pareto.nao_pareto_runs import (
    CRITERION,
    PHASES,
    ParetoEffort,
    make_run,
    make_searches,
    make_spec,
)
from compare.papers.nao_pareto.nao_pareto_tables import make_tables
from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction, Verdict
from compare.questions.pareto.compare import Challenge, challenge
from compare.questions.pareto.search import REFERENCE
from compare.questions.pareto.study import pareto_study
from compare.study.store import Computation, Store
from compare.study.stored_solver import store_runs
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode


def run_pareto(runner: Runner, effort: ParetoEffort) -> ParetoFindings:
    """Solve for the true front of each phase, run the searches on it, and solve again from their best points."""
    return ParetoFindings(phases=tuple(_run_phase(runner, phase, effort) for phase in PHASES), effort=effort)


def _run_phase(runner: Runner, phase: str, effort: ParetoEffort) -> PhaseFindings:
    store = Store(runner.folder / phase, runner.progress)
    study = pareto_study(
        make_spec(phase, effort).load(),
        CRITERION,
        points=effort.points,
        starts=effort.starts,
        searches={},
        runs=effort.runs,
        seed=0,
        store=store,
        progress=runner.progress,
    )
    results = runner.compute(make_searches(phase, study.front, effort), code=(nao_pareto_runs,))
    runs = tuple(make_run(result) for result in results.values())
    points = collect_points(study.front, runs)
    solve = partial(challenge, study.problem, study.criterion, study.front, points, store_runs(store), runner.progress)
    step = Computation(
        name=f"{phase}-challenge",
        inputs={
            **fingerprint(study.problem),
            "criterion": CRITERION,
            "front": [asdict(point) for point in study.front],
            "points": [asdict(point) for point in points],
        },
        function=lambda: asdict(solve()),
    )
    (answer,) = runner.compute([step], code=()).values()
    return PhaseFindings(
        problem=study.problem,
        criterion=study.criterion,
        first_front=study.front,
        answer=decode(Challenge, answer),
        runs=runs,
    )


def compute_values(findings: ParetoFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    ssp, dsp = findings.phases
    effort, verdicts = findings.effort, [claim.verdict for claim in check_claims(findings)]
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
        "held": verdicts.count(Verdict.HOLDS),
        "refuted": verdicts.count(Verdict.FAILS),
        "robot": ssp.problem.options["robot"],
        "ssp": {"variables": len(ssp.problem.names)},
        "dsp": {"variables": len(dsp.problem.names)},
    }


REPRODUCTION = Reproduction(
    template="nao_pareto/nao_pareto_report.md",
    full=ParetoEffort(),
    quick=ParetoEffort(runs=1, budgets=(200,), points=5, starts=1, intervals=4),
    run=run_pareto,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    claims=check_claims,
)
