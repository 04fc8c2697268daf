"""Gupta, Pratihar, Deb (2023), reproduced: Tables 6 to 9, Figs. 9 to 20, the tests of section 5.3 and the paper's claims."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import metaheuristics
import nlp_gait
from compare.drawing.figures import save
from compare.papers.nao import figures
from compare.papers.nao.findings import ALGORITHMS, Findings, PhaseFindings, Points, best_start, sweep_values
from compare.papers.nao.paper import DURATIONS_S, PHASES, SSP, SWING_HEIGHT, SWING_POWER_W, PrintedPhase
from compare.papers.nao.report import write_report
from compare.papers.nao.runs import read_points, search, solve, sweep
from compare.study.parallel import Job, run_jobs
from compare.study.steps import fingerprint
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.files import writable_folder
from nlp_gait.problem import GaitProblem

RUNS, EVALUATIONS, STARTS = 11, 10_000, 20
LEVER_STARTS, SWEEP_STARTS = 5, 2
SWEEP_POINTS = (13, 10)  # over the range of all feasible solutions, and of the cheap ones
LEVER = {"torso_share": "lever"}
# Notes to `progress`: all jobs, and one for figures and report.
STEPS = len(PHASES) * (2 * RUNS + STARTS) + LEVER_STARTS + 2 + sum(len(p.optima["pso"].x) for p in PHASES) + 1


def reproduce(out: Path, *, progress: Callable[[str], None]) -> None:
    """Write tables (Markdown, CSV), figures (PNG, SVG), every feasible solution evaluated (npz) and ``report.md``.

    Args:
        out: folder; results of finished steps are kept in ``out/steps`` and used again.
        progress: told about each step, ``STEPS`` times.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    writable_folder(folder / "points")
    problems = {phase.problem: nlp_gait.load(phase.problem) for phase in PHASES}
    results = _run(folder, _first_jobs(folder, problems), progress)
    points = {phase.problem: _points(folder, phase) for phase in PHASES}
    results |= _run(folder, _sweep_jobs(problems, points, results), progress)
    ssp, dsp = (_phase(phase, problems[phase.problem], results, points[phase.problem]) for phase in PHASES)
    findings = Findings(
        ssp=ssp,
        dsp=dsp,
        swing=results["table7-swing-heights"],
        durations=results["durations"],
        lever=[results[f"nao-dsp-lever-ipopt-{k:02d}"] for k in range(LEVER_STARTS)],
    )
    progress("figures, tables and report")
    for name, figure in figures.all_figures(findings):
        save(figure, folder / name)
    write_report(folder, findings)


def _run(folder: Path, jobs: list[Job], progress: Callable[[str], None]) -> dict[str, Any]:
    return dict(zip((job.name for job in jobs), run_jobs(folder, jobs, progress), strict=True))


def _first_jobs(folder: Path, problems: Mapping[str, GaitProblem]) -> list[Job]:
    """Searches and starts of IPOPT."""
    jobs = []
    for name, problem in problems.items():
        inputs = {**fingerprint(problem), "ipopt": repr(IpoptSettings())}
        jobs += [_start_job(f"{name}-ipopt-{k:02d}", name, k, inputs) for k in range(STARTS)]
        for algorithm in ALGORITHMS:
            settings = {"algorithm": repr(metaheuristics.algorithm(algorithm)), "evaluations": EVALUATIONS}
            for run in range(RUNS):
                points = _points_file(folder, name, algorithm, run)
                arguments = {"problem": name, "algorithm": algorithm, "seed": run, "evaluations": EVALUATIONS}
                jobs.append(
                    Job(
                        name=points.stem,
                        inputs={**fingerprint(problem), **settings, "seed": run},
                        compute=search,
                        arguments={**arguments, "points": points},
                        beside=points,
                    )
                )
    inputs = {**fingerprint(nlp_gait.load("nao-dsp", **LEVER)), "ipopt": repr(IpoptSettings())}
    return jobs + [
        _start_job(f"nao-dsp-lever-ipopt-{k:02d}", "nao-dsp", k, inputs, options=LEVER) for k in range(LEVER_STARTS)
    ]


def _start_job(name: str, problem: str, seed: int, inputs: Mapping[str, object], **options: object) -> Job:
    arguments = {"problem": problem, "seed": seed, **options}
    return Job(name=name, inputs={**inputs, "seed": seed}, compute=solve, arguments=arguments)


def _sweep_jobs(
    problems: Mapping[str, GaitProblem], points: Mapping[str, Mapping[str, Points]], results: Mapping[str, Any]
) -> list[Job]:
    """IPOPT over each variable's feasible range, over the paper's swing heights, and over durations."""
    best = {name: best_start([results[f"{name}-ipopt-{k:02d}"] for k in range(STARTS)])["x"] for name in problems}
    ssp = problems[SSP.problem]
    jobs = [
        _sweep_job("table7-swing-heights", ssp, SWING_HEIGHT, list(SWING_POWER_W["pso"])),
        _sweep_job("durations", ssp, SSP.duration, list(DURATIONS_S)),
    ]
    return jobs + [
        _sweep_job(f"{name}-sweep-x{i + 1}", problem, i, sweep_values(points[name], i, best[name][i], SWEEP_POINTS))
        for name, problem in problems.items()
        for i in range(len(problem.names))
    ]


def _sweep_job(name: str, problem: GaitProblem, position: int, values: list[float]) -> Job:
    variable = problem.names[position]
    swept = {"variable": variable, "values": values, "starts": SWEEP_STARTS}
    return Job(
        name=name,
        inputs={**fingerprint(problem), "ipopt": repr(IpoptSettings()), **swept},
        compute=sweep,
        arguments={"problem": problem.name, **swept},
    )


def _points_file(folder: Path, problem: str, algorithm: str, run: int) -> Path:
    return folder / "points" / f"{problem}-{algorithm}-{run:02d}.npz"


def _points(folder: Path, phase: PrintedPhase) -> dict[str, Points]:
    """Feasible solutions of all runs, by algorithm."""
    found = {}
    for algorithm in ALGORITHMS:
        runs = [read_points(_points_file(folder, phase.problem, algorithm, run)) for run in range(RUNS)]
        found[algorithm] = Points(
            x=np.concatenate([x for x, _ in runs]),
            power_W=np.concatenate([power for _, power in runs]),
            run=np.concatenate([np.full(len(power), float(run)) for run, (_, power) in enumerate(runs)]),
        )
    return found


def _phase(
    paper: PrintedPhase, problem: GaitProblem, results: Mapping[str, Any], points: Mapping[str, Points]
) -> PhaseFindings:
    name = paper.problem
    return PhaseFindings(
        paper=paper,
        problem=problem,
        searches={a: [results[f"{name}-{a}-{run:02d}"] for run in range(RUNS)] for a in ALGORITHMS},
        starts=[results[f"{name}-ipopt-{k:02d}"] for k in range(STARTS)],
        sweeps={i: results[f"{name}-sweep-x{i + 1}"] for i in range(len(problem.names))},
        points=points,
    )
