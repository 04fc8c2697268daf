"""Gupta, Pratihar, Deb (2025), as far as its abstract tells: four algorithms on power against stability, and its claims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from compare.papers.nao_pareto import nao_pareto_runs as nao_pareto_runs
from compare.papers.nao_pareto.nao_pareto_findings import Findings, PhaseFindings, points_found
from compare.papers.nao_pareto.nao_pareto_runs import CRITERION, PHASES, Effort, FrontRun, searches, spec_of
from compare.papers.nao_pareto.report import document
from compare.questions.pareto.compare import Challenge, challenge
from compare.questions.pareto.study import ParetoStudy, pareto_study
from compare.report.writing import write_document
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decoded
from nlp_gait.files import writable_folder
from nlp_gait.progress import Progress

FULL = Effort()


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG).

    Args:
        out: folder; finished results in it are reused.
        progress: told about each solve and each run.
        effort: how much is computed.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    stores = {phase: Store(folder / phase, progress) for phase in PHASES}
    fronts = {phase: _front(phase, effort, stores[phase], progress) for phase in PHASES}
    todo = {phase: searches(phase, fronts[phase].front, effort) for phase in PHASES}
    computations = [computation for phase in PHASES for computation, _ in todo[phase]]
    results = Store(folder).compute_all(computations, code=[nao_pareto_runs], progress=progress)
    made = {phase: [run_of(results[computation.name]) for computation, run_of in todo[phase]] for phase in PHASES}
    found = tuple(
        PhaseFindings(
            problem=fronts[phase].problem,
            criterion=fronts[phase].criterion,
            first_front=fronts[phase].front,
            answer=_answer(folder, fronts[phase], made[phase], stores[phase], progress),
            runs=tuple(made[phase]),
        )
        for phase in PHASES
    )
    progress("figures, tables and report")
    write_document(folder, document(Findings(phases=found, effort=effort)))


def _front(phase: str, effort: Effort, store: Store, progress: Progress) -> ParetoStudy:
    """The true front of a phase, from the gradient method alone."""
    return pareto_study(
        spec_of(phase, effort).load(),
        CRITERION,
        points=effort.points,
        starts=effort.starts,
        searches={},
        runs=effort.runs,
        seed=0,
        store=store,
        progress=progress,
    )


def _answer(folder: Path, study: ParetoStudy, made: Sequence[FrontRun], store: Store, progress: Progress) -> Challenge:
    """Solves from the best points of all runs, which may move the front."""
    points = points_found(study, made)
    inputs = {
        **fingerprint(study.problem),
        "criterion": CRITERION,
        "front": [asdict(point) for point in study.front],
        "points": [asdict(point) for point in points],
    }
    solve = partial(challenge, study.problem, study.criterion, study.front, points, store_runs(store), progress)
    name = f"{study.problem.name}-challenge"
    return decoded(Challenge, Store(folder).compute(name, inputs, lambda: asdict(solve()), progress=progress))
