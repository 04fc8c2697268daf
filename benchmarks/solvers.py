"""Rows about IPOPT as a whole: on few rows and on all, against a search, and many starts at once."""

from __future__ import annotations

import time

import numpy as np

import nlp_gait
from benchmarks.rows import Row, ratio, side_by_side
from compare.analysis.comparison import compare_problems
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec
from nlp_gait.backends.solve import count_workers
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation.solution import Outcome

TARGET = 1e-6  # relative distance from the best known objective: 1e-4 %
SAME_OPTIMUM = 1e-4  # relative


def few_rows(starts: int, name: str = "nao-ssp", required: float | None = None) -> list[Row]:
    """Process time of a start of IPOPT that begins with the rows that matter, and with all rows, from the same points in turn."""
    problem = nlp_gait.load(name)
    solvers = {few: IpoptSettings(compiled=True, few_rows=few).prepare(problem) for few in (True, False)}
    rng = np.random.default_rng(0)
    times: dict[bool, list[float]] = {few: [] for few in solvers}
    ends: dict[bool, list[Outcome]] = {few: [] for few in solvers}
    for _ in range(starts):
        x0 = problem.start_point(rng)
        for few, solver in solvers.items():
            started = time.process_time()
            ends[few].append(solver.run(problem, x0))
            times[few].append(time.process_time() - started)
    best = min(end.cost for outcomes in ends.values() for end in outcomes if end.converged)
    reached = {
        few: sum(end.converged and end.cost <= best + SAME_OPTIMUM * abs(best) for end in outcomes)
        for few, outcomes in ends.items()
    }
    return [
        Row(
            name=f"a start of {name}, IPOPT, compiled",
            value=1e3 * float(np.median(times[True])),
            unit="ms",
            required=required,
            at_most=True,
            note=f"with all rows {1e3 * np.median(times[False]):.0f} ms; of processor",
        ),
        Row(
            name=f"IPOPT on few rows, starts of {name} that reach the best",
            value=reached[True],
            unit=f"of {starts}",
            note=f"with all rows {reached[False]}",
        ),
    ]


def stairs_plan(starts: int) -> list[Row]:
    """Starts of the planned step."""
    solution = nlp_gait.solve("stairs-plan", starts=starts, seed=0, solver=IpoptSettings(compiled=True))
    best = min(start.cost for start in solution.starts if start.converged)
    converged = [start for start in solution.starts if start.converged]
    reached = sum(start.cost <= best + SAME_OPTIMUM * abs(best) for start in converged)
    share = starts / 20
    return [
        Row(
            name="stairs-plan, starts that converge",
            value=len(converged),
            unit=f"of {starts}",
            required=18 * share,
            ambition=20 * share,
        ),
        Row(
            name="stairs-plan, starts that reach the best",
            value=reached,
            unit=f"of {starts}",
            required=12 * share,
            ambition=18 * share,
            note=f"{best:.3f} J",
        ),
    ]


def expected_times(runs: int) -> list[Row]:
    """Expected time to 1e-4 % of the best known power, as the default report says it, but for fewer runs."""
    names = ("ipopt", "aco")
    settings = StudySettings(
        problems=(ProblemSpec(name="nao-ssp"),),
        solvers=tuple(SolverSpec(name=name) for name in names),
        runs=runs,
        starts=20,
    )
    (comparison,) = compare_problems(run_study(Study(tasks=settings.tasks())))
    seconds = {solver.name: solver.expected_cost(TARGET, "seconds") for solver in comparison.solvers}
    return [
        Row(
            name="expected time to 1e-4 %, ACO against the best gradient solver",
            value=seconds["aco"] / seconds["ipopt"],
            unit="x",
            required=1,
            ambition=3,
            note=", ".join(f"{name} {seconds[name] * 1e3:.0f} ms" for name in names),
        )
    ]


def starts_at_once(rounds: int) -> list[Row]:
    """Twenty starts in one process and in as many as there are processors."""
    problem, solver, workers = nlp_gait.load("nao-ssp"), IpoptSettings(compiled=True), count_workers()
    times = side_by_side(
        {
            str(count): lambda count=count: nlp_gait.solve(problem, starts=20, solver=solver, workers=count)
            for count in (1, workers)
        },
        rounds,
    )
    return [
        Row(
            name="20 starts in processes against one after the other",
            value=ratio(times["1"], times[str(workers)]),
            unit="x",
            required=1.8 if workers > 1 else None,
            note=f"{workers} processors, wall time: others' load counts",
        )
    ]
