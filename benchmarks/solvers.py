"""Rows about NLP solvers as a whole: the condensed method against IPOPT, both against a search, and many starts at once."""

from __future__ import annotations

import time

import numpy as np

import nlp_gait
from benchmarks.rows import Row, ratio, side_by_side
from compare.analysis.comparison import compare_problems
from compare.study.settings import SolverSpec, StudySettings
from compare.study.study import Study, run_study
from compare.study.task import ProblemSpec
from nlp_gait.backends.solvers.condensed import CondensedSettings
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.starts import available_workers
from nlp_gait.problem.solution import Outcome

TARGET = 1e-6  # relative distance from the best known objective: 1e-4 %
SAME_OPTIMUM = 1e-4  # relative


def condensed_against_ipopt(starts: int, name: str = "nao-ssp") -> list[Row]:
    """Process time of a start and ends, both with compiled derivatives, from the same points in turn."""
    problem = nlp_gait.load(name)
    solvers = {
        "ipopt": IpoptSettings(compiled=True).ready_for(problem),
        "condensed": CondensedSettings(compiled=True).ready_for(problem),
    }
    rng = np.random.default_rng(0)
    times: dict[str, list[float]] = {each: [] for each in solvers}
    ends: dict[str, list[Outcome]] = {each: [] for each in solvers}
    for _ in range(starts):
        x0 = problem.start_point(rng)
        for each, solver in solvers.items():
            started = time.process_time()
            ends[each].append(solver.run(problem, x0))
            times[each].append(time.process_time() - started)
    best = min(end.cost for outcomes in ends.values() for end in outcomes if end.success)
    reached = {
        each: sum(end.success and end.cost <= best + SAME_OPTIMUM * abs(best) for end in outcomes)
        for each, outcomes in ends.items()
    }
    return [
        Row(
            name=f"condensed against IPOPT, one start of {name}",
            value=ratio(np.array(times["ipopt"]), np.array(times["condensed"])),
            unit="x",
            required=5,
            ambition=10,
            note=f"median {np.median(times['condensed']) * 1e3:.1f} and {np.median(times['ipopt']) * 1e3:.1f} ms of processor",
        ),
        Row(
            name=f"condensed, starts of {name} that reach the best",
            value=reached["condensed"],
            unit=f"of {starts}",
            required=reached["ipopt"],
            note=f"IPOPT {reached['ipopt']}",
        ),
    ]


def stairs_plan(starts: int) -> list[Row]:
    """Starts of the planned step."""
    solution = nlp_gait.solve("stairs-plan", starts=starts, seed=0, solver=IpoptSettings(compiled=True))
    best = min(start.cost for start in solution.starts if start.success)
    converged = [start for start in solution.starts if start.success]
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
    names = ("ipopt", "condensed", "aco")
    settings = StudySettings(
        problems=(ProblemSpec(name="nao-ssp"),),
        solvers=tuple(SolverSpec(algorithm=name) for name in names),
        runs=runs,
        starts=20,
    )
    (comparison,) = compare_problems(run_study(Study(tasks=settings.tasks())))
    seconds = {solver.name: solver.expected_cost(TARGET, "seconds") for solver in comparison.solvers}
    fastest = min(names[:2], key=lambda name: seconds[name])
    return [
        Row(
            name="expected time to 1e-4 %, ACO against the best gradient solver",
            value=seconds["aco"] / seconds[fastest],
            unit="x",
            required=1,
            ambition=3,
            note=", ".join(f"{name} {seconds[name] * 1e3:.0f} ms" for name in names),
        )
    ]


def starts_at_once(rounds: int) -> list[Row]:
    """Twenty starts in one process and in as many as there are processors."""
    problem, solver, workers = nlp_gait.load("nao-ssp"), IpoptSettings(compiled=True), available_workers()
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
