"""Gupta, Pratihar, Deb (2023), reproduced: Tables 6 to 9, Figs. 9 to 20, the tests of section 5.3 and the paper's claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from compare.papers.nao import nao_runs as nao_runs
from compare.papers.nao.nao_findings import Findings, PhaseFindings, Points, sweep_values
from compare.papers.nao.nao_paper import PHASES, PrintedPhase
from compare.papers.nao.nao_runs import (
    ALGORITHMS,
    DURATION_SWEEP,
    LEVER,
    SWING_SWEEP,
    Effort,
    Held,
    load_points,
    run_storing_points,
    spec_of,
    special_sweeps,
    sweep_step,
    tasks,
)
from compare.papers.nao.report import document
from compare.papers.paper_runs import Runs, best, run_all
from compare.report.writing import write_document
from compare.study.store import Computation, Store
from compare.study.study import record_file
from compare.study.task import IPOPT, Task
from nlp_gait.files import writable_folder
from nlp_gait.progress import Progress

FULL = Effort()
STEPS = FULL.steps


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables (CSV), figures (PNG, SVG) and every feasible solution evaluated (npz).

    Args:
        out: folder; finished runs in ``out/records`` and results in ``out/store`` are reused.
        progress: told about each run and each step, ``effort.steps`` times.
        effort: how much is computed.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    store = Store(folder)
    todo = tasks(effort)
    searches = [task for task in todo if task.is_search]
    for task in searches:
        if load_points(store, task) is None:
            record_file(folder, task).unlink(missing_ok=True)  # its points come with the run
    runs = run_all(folder, todo, progress, partial(run_storing_points, folder))
    points = {phase.problem: _points(store, phase, searches) for phase in PHASES}
    sweeps = special_sweeps(effort) + [
        step for phase in PHASES for step in _variable_sweeps(phase, runs, points[phase.problem], effort)
    ]
    results = store.compute_all(sweeps, code=[nao_runs], progress=progress)
    held = {name: [Held(**row) for row in rows] for name, rows in results.items()}
    ssp, dsp = (_phase(phase, effort, runs, held, points[phase.problem]) for phase in PHASES)
    findings = Findings(
        ssp=ssp, dsp=dsp, swing=held[SWING_SWEEP], durations=held[DURATION_SWEEP], lever=runs[LEVER, IPOPT]
    )
    progress("figures, tables and report")
    write_document(folder, document(findings))


def _variable_sweeps(
    phase: PrintedPhase, runs: Runs, points: Mapping[str, Points], effort: Effort
) -> list[Computation]:
    """IPOPT over each variable's feasible range."""
    optimum = best(runs[phase.problem, IPOPT]).x
    return [
        sweep_step(
            _sweep_name(phase, i),
            spec_of(phase.problem, effort),
            i,
            sweep_values(points, i, value, effort.sweep_points),
            effort.sweep_starts,
        )
        for i, value in enumerate(optimum.values())
    ]


def _sweep_name(phase: PrintedPhase, position: int) -> str:
    return f"{phase.problem}-sweep-x{position + 1}"


def _points(store: Store, phase: PrintedPhase, searches: Sequence[Task]) -> dict[str, Points]:
    """Feasible solutions of all runs, by algorithm."""
    found = {}
    for algorithm in ALGORITHMS:
        own = [task for task in searches if (task.problem.title, task.title) == (phase.problem, algorithm)]
        runs = [points for task in own if (points := load_points(store, task)) is not None]
        found[algorithm] = Points(
            x=np.concatenate([x for x, _ in runs]),
            power_W=np.concatenate([power for _, power in runs]),
            run=np.concatenate([np.full(len(power), float(run)) for run, (_, power) in enumerate(runs)]),
        )
    return found


def _phase(
    paper: PrintedPhase,
    effort: Effort,
    runs: Runs,
    held: Mapping[str, Sequence[Held]],
    points: Mapping[str, Points],
) -> PhaseFindings:
    problem = spec_of(paper.problem, effort).load()
    return PhaseFindings(
        paper=paper,
        problem=problem,
        searches={name: runs[paper.problem, name] for name in ALGORITHMS},
        starts=runs[paper.problem, IPOPT],
        sweeps={i: held[_sweep_name(paper, i)] for i in range(len(problem.names))},
        points=points,
    )
