"""Gupta, Pratihar, Deb (2023), reproduced: Tables 6 to 9, Figs. 9 to 20, the tests of section 5.3 and the paper's claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from compare.papers.nao import nao_runs
from compare.papers.nao.nao_claims import check_claims
from compare.papers.nao.nao_figures import draw_figures
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings, Points, choose_sweep_values
from compare.papers.nao.nao_paper import PHASES, PrintedPhase
from compare.papers.nao.nao_runs import (
    ALGORITHMS,
    DURATION_SWEEP,
    LEVER,
    SWING_SWEEP,
    NaoEffort,
    SweepPoint,
    load_points,
    make_spec,
    make_special_sweeps,
    make_sweep,
    make_tasks,
    run_and_store_points,
)
from compare.papers.nao.nao_tables import make_tables
from compare.papers.paper_runs import Runner, Runs, choose_best, compute_range
from compare.papers.reproduction import Reproduction
from compare.study.record_files import locate_record
from compare.study.store import Computation, Store
from compare.study.task import IPOPT, Task


def run_nao(runner: Runner, effort: NaoEffort) -> NaoFindings:
    """Run searches and IPOPT on both phases, and sweep over their variables."""
    store = Store(runner.folder)
    tasks = make_tasks(effort)
    searches = [task for task in tasks if task.is_search]
    for task in searches:
        if load_points(store, task) is None:
            locate_record(runner.folder, task).unlink(missing_ok=True)  # only a run gives its points
    runs = runner.run_tasks(tasks, partial(run_and_store_points, runner.folder))
    points = {phase.problem: _read_all_points(store, phase, searches) for phase in PHASES}
    sweeps = make_special_sweeps(effort)
    for phase in PHASES:
        sweeps += _make_variable_sweeps(phase, runs, points[phase.problem], effort)
    results = runner.compute(sweeps, code=(nao_runs,))
    optima = {name: [SweepPoint(**row) for row in rows] for name, rows in results.items()}
    ssp, dsp = (_collect_phase(phase, effort, runs, optima, points[phase.problem]) for phase in PHASES)
    return NaoFindings(
        ssp=ssp, dsp=dsp, swing=optima[SWING_SWEEP], durations=optima[DURATION_SWEEP], lever=runs[LEVER, IPOPT]
    )


def _make_variable_sweeps(
    phase: PrintedPhase, runs: Runs, points: Mapping[str, Points], effort: NaoEffort
) -> list[Computation]:
    """IPOPT over each variable's feasible range."""
    optimum = choose_best(runs[phase.problem, IPOPT]).x
    spec = make_spec(phase.problem, effort)
    return [
        make_sweep(
            _name_sweep(phase, i),
            spec,
            i,
            choose_sweep_values(points, i, value, effort.sweep_points),
            effort.sweep_starts,
        )
        for i, value in enumerate(optimum.values())
    ]


def _name_sweep(phase: PrintedPhase, position: int) -> str:
    return f"{phase.problem}-sweep-x{position + 1}"


def _read_all_points(store: Store, phase: PrintedPhase, searches: Sequence[Task]) -> dict[str, Points]:
    """Feasible solutions of all runs, by search."""
    found = {}
    for algorithm in ALGORITHMS:
        tasks = [task for task in searches if (task.problem.title, task.title) == (phase.problem, algorithm)]
        runs = [points for task in tasks if (points := load_points(store, task)) is not None]
        found[algorithm] = Points(
            x=np.concatenate([x for x, _ in runs]),
            power_W=np.concatenate([power for _, power in runs]),
            run=np.repeat(np.arange(len(runs), dtype=float), [len(power) for _, power in runs]),
        )
    return found


def _collect_phase(
    paper: PrintedPhase,
    effort: NaoEffort,
    runs: Runs,
    sweeps: Mapping[str, Sequence[SweepPoint]],
    points: Mapping[str, Points],
) -> PhaseFindings:
    problem = make_spec(paper.problem, effort).load()
    return PhaseFindings(
        paper=paper,
        problem=problem,
        searches={name: runs[paper.problem, name] for name in ALGORITHMS},
        starts=runs[paper.problem, IPOPT],
        sweeps={i: sweeps[_name_sweep(paper, i)] for i in range(len(problem.names))},
        points=points,
    )


def compute_values(findings: NaoFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
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
        "ssp": _compute_phase_values(ssp),
        "dsp": _compute_phase_values(dsp),
        "costs": compute_range(100 * (here.objective / dsp.best - 1) for here in dsp.printed_here.values()),
        "lever": f"{lever} ({len(solved)} of {len(findings.lever)} starts converged)",
        "gaps": compute_range(power - here for power, here, _ in printed),
        "misses": compute_range(100 * (twice / power - 1) for power, _, twice in printed),
    }


def _compute_phase_values(phase: PhaseFindings) -> dict[str, Any]:
    """Values of one phase; ``broken`` counts final solutions that violate a constraint between the paper's samples."""
    ends = [run.verdict for runs in phase.searches.values() for run in runs if run.verdict.feasible]
    optimum = phase.optimum.verdict
    return {
        "converged": phase.converged,
        "medians": ", ".join(f"{phase.median_run(name)} of {NAMES[name]}" for name in ALGORITHMS),
        "feasible": len(ends),
        "broken": sum(end.dense_feasible is False for end in ends),
        "optimum": "does not" if optimum.dense_feasible else f"violates {optimum.violated[0]}",
        "below": 100 * max(phase.share_below(i) for i in phase.sweeps),
    }


REPRODUCTION = Reproduction(
    template="nao/nao_report.md",
    full=NaoEffort(),
    quick=NaoEffort(
        runs=3, evaluations=1000, starts=1, lever_starts=1, intervals=4, sweep_starts=1, sweep_points=(0, 0)
    ),
    run=run_nao,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    claims=check_claims,
)
