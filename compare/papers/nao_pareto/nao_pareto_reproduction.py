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
from compare.questions.kept import Finished
from compare.questions.pareto.compare import Challenge, challenge
from compare.questions.pareto.study import ParetoStudy, pareto_study
from compare.report.writing import write_document
from compare.study.steps import Steps
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decoded
from nlp_gait.files import writable_folder
from nlp_gait.progress import Progress

FULL = Effort()


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG).

    Args:
        out: folder; finished solves, fronts and runs in it are used again.
        progress: told about each solve and each run.
        effort: how much is computed.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    kept = {phase: Finished(folder / phase, progress) for phase in PHASES}
    fronts = {phase: _front(folder, phase, effort, kept[phase], progress) for phase in PHASES}
    todo = {phase: searches(phase, fronts[phase].front, effort) for phase in PHASES}
    steps = Steps(folder, progress, code=(nao_pareto_runs,))
    results = iter(steps.side_by_side([step for phase in PHASES for step, _ in todo[phase]]))
    made = {phase: [run_of(next(results)) for _, run_of in todo[phase]] for phase in PHASES}
    found = tuple(
        PhaseFindings(
            problem=fronts[phase].problem,
            criterion=fronts[phase].criterion,
            first_front=fronts[phase].front,
            answer=_answer(folder, fronts[phase], made[phase], kept[phase], progress),
            runs=tuple(made[phase]),
        )
        for phase in PHASES
    )
    progress("figures, tables and report")
    write_document(folder, document(Findings(phases=found, effort=effort)))


def _front(folder: Path, phase: str, effort: Effort, finished: Finished, progress: Progress) -> ParetoStudy:
    """The true front of a phase, from the gradient method alone."""
    return pareto_study(
        spec_of(phase, effort).load(),
        CRITERION,
        writable_folder(folder / phase),
        points=effort.points,
        starts=effort.starts,
        searches={},
        runs=effort.runs,
        seed=0,
        finished=finished,
        progress=progress,
    )


def _answer(
    folder: Path, study: ParetoStudy, made: Sequence[FrontRun], finished: Finished, progress: Progress
) -> Challenge:
    """Solves from the best points of all runs, which may move the front."""
    points = points_found(study, made)
    inputs = {
        **fingerprint(study.problem),
        "criterion": CRITERION,
        "front": [asdict(point) for point in study.front],
        "points": [asdict(point) for point in points],
    }
    solve = partial(challenge, study.problem, study.criterion, study.front, points, finished.solver(), progress)
    steps = Steps(folder, progress)
    return decoded(Challenge, steps(f"{study.problem.name}-challenge", inputs, lambda: asdict(solve())))
