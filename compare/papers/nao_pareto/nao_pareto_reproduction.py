"""Gupta, Pratihar, Deb (2025), as far as the abstract says: four searches on power against stability, and its claims."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from compare.analysis.units import join_words
from compare.papers.claims import Verdict
from compare.papers.nao_pareto import nao_pareto_runs
from compare.papers.nao_pareto.nao_pareto_claims import CHECKS, NEAR
from compare.papers.nao_pareto.nao_pareto_figures import draw_figures
from compare.papers.nao_pareto.nao_pareto_findings import (
    EVEN_POINTS,
    NAMES,
    ParetoFindings,
    PhaseFindings,
    collect_points,
)
from compare.papers.nao_pareto.nao_pareto_runs import (
    CRITERION,
    PHASES,
    ParetoEffort,
    make_run,
    make_searches,
    make_spec,
)
from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction
from compare.questions.pareto.pareto_front import ParetoFront
from compare.questions.pareto.searches import REFERENCE, Challenge, challenge_front
from compare.questions.question import Work, find
from compare.report.document import Rows, Value
from compare.study.store import Computation, Store
from metaheuristics.multi_objective import constrained_moead, dynamic_nsga3, pymoo
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode


def run_pareto(runner: Runner, effort: ParetoEffort) -> ParetoFindings:
    """Solve for the true front of each phase, run the searches on it, and solve again from their best points."""
    return ParetoFindings(phases=tuple(_run_phase(runner, phase, effort) for phase in PHASES), effort=effort)


def _run_phase(runner: Runner, phase: str, effort: ParetoEffort) -> PhaseFindings:
    work = Work(store=Store(runner.folder / phase, runner.progress), progress=runner.progress)
    problem = make_spec(phase, effort).load()
    question = ParetoFront(problem=problem, objective=CRITERION, points=effort.points, starts=effort.starts)
    front, criterion = find(question, work).front, question.criterion
    problem = criterion.drop_demand(problem)
    searches = make_searches(phase, front, effort)
    code = (nao_pareto_runs, constrained_moead, dynamic_nsga3, pymoo)
    results = runner.compute([search for of_case in searches.values() for search in of_case], code)
    runs = {case: [make_run(results[search.name]) for search in of_case] for case, of_case in searches.items()}
    points = collect_points(front, (run for of_case in runs.values() for run in of_case))
    solve = partial(challenge_front, problem, criterion, front, points, work.solver(), work.progress)
    step = Computation(
        name=f"{phase}-challenge",
        inputs={
            **fingerprint(problem),
            "criterion": CRITERION,
            "front": [asdict(point) for point in front],
            "points": [asdict(point) for point in points],
        },
        function=lambda: asdict(solve()),
    )
    (answer,) = runner.compute([step], code=()).values()
    return PhaseFindings(
        problem=problem,
        criterion=criterion,
        first_front=front,
        answer=decode(Challenge, answer),
        runs=runs,
    )


def compute_values(findings: ParetoFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    ssp, dsp = findings.phases
    effort, verdicts = findings.effort, [claim.verdict for claim in REPRODUCTION.check_claims(findings).values()]
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


def make_tables(findings: ParetoFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    tables: dict[str, Rows] = {"fronts": [_make_front_row(phase) for phase in findings.phases]}
    for phase in findings.phases:
        tables[f"ends-{phase.problem.name}"] = _make_ends(phase)
        tables[f"constraints-{phase.problem.name}"] = _make_constraints(phase)
        tables[f"running-{phase.problem.name}"] = _make_running(phase)
    return tables


def _make_front_row(phase: PhaseFindings) -> list[Value]:
    low, high, answer = phase.front[0], phase.front[-1], phase.answer
    ends = [low.value, low.power_W, high.value, high.power_W]
    solved = [answer.points, answer.solved, 100 * answer.least_gap, answer.moved]
    return [phase.problem.name, len(phase.front), *ends, len(phase.bends.knees), *solved]


def _make_ends(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        ends = (100 * m.hypervolume[:, -1], m.igd[:, -1])
        spread = [float(value) for end in ends for value in (np.median(end), end.min(), end.max())]
        rows.append([NAMES[name], budget, len(m.time_s), *spread])
    return rows


def _make_constraints(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        columns = (100 * m.feasible, m.first_feasible, m.until(NEAR), m.time_s, m.objective_time_s)
        medians = [float(np.median(column)) for column in columns]
        rows.append([NAMES[name], budget, int(np.sum(m.hypervolume[:, -1] > 0.0)), *medians])
    return rows


def _make_running(phase: PhaseFindings) -> Rows:
    """Medians at each look of the runs with the largest budget."""
    chosen = [m for (_, budget), m in phase.measures.items() if budget == phase.budgets[-1]]
    columns = [chosen[0].evaluations]
    columns += [100 * np.median(m.hypervolume, axis=0) for m in chosen] + [np.median(m.igd, axis=0) for m in chosen]
    return np.column_stack(columns).tolist()


REPRODUCTION = Reproduction(
    name="nao_pareto",
    full=ParetoEffort(),
    run=run_pareto,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    checks=CHECKS,
)
