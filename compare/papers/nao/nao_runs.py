"""Runs and sweeps of the reproduction of the NAO paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from compare.judge import evaluate
from compare.papers.nao.nao_paper import PAPER, PHASES, SSP, SWING_HEIGHT
from compare.papers.paper_runs import Effort, make_computation
from compare.study.record import RunRecord
from compare.study.run_task import run_task
from compare.study.store import Computation, Store
from compare.study.task import IPOPT, ProblemSpec, Stop, Task
from nlp_gait.backends.optima.continuation import solve_both_ways
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.nao.joints import PLANNED_JOINTS

ALGORITHMS = ("pso", "ga")
LEVER = "nao-dsp-lever"
SWING_SWEEP, DURATION_SWEEP = "table7-swing-heights", "durations"


@dataclass(frozen=True, kw_only=True)
class NaoEffort(Effort):
    """Effort of the reproduction of the NAO paper."""

    runs: int = 11  # of each search, as in the paper
    evaluations: int = 10_000  # of a search, as in the paper
    starts: int = 20  # of IPOPT
    lever_starts: int = 5  # of IPOPT with the lever rule for the torso's share
    intervals: int = 10  # between the samples of a phase, as in the paper
    sweep_starts: int = 2  # at both ends of a sweep
    sweep_points: tuple[int, int] = (13, 10)  # over the range of all feasible solutions, and of the cheap ones

    @property
    def steps(self) -> int:
        """Runs, two special sweeps and one over each variable, and the report."""
        variables = sum(len(phase.optima["pso"].x) for phase in PHASES)
        return len(PHASES) * (len(ALGORITHMS) * self.runs + self.starts) + self.lever_starts + 2 + variables + 1


@dataclass(frozen=True, kw_only=True)
class SweepPoint:
    """IPOPT's optimum with a variable fixed at a value."""

    at: float
    power_W: float
    feasible: bool


def make_tasks(effort: NaoEffort) -> list[Task]:
    """Return searches and starts of IPOPT; equal runs of the searches start from the same population."""
    stop = Stop(evaluations=effort.evaluations)
    specs = [make_spec(phase.problem, effort) for phase in PHASES]
    lever = replace(specs[1].with_options(torso_share="lever"), label=LEVER)
    tasks = [
        Task(problem=spec, solver=name, stop=stop, run=k)
        for spec in specs
        for name in ALGORITHMS
        for k in range(effort.runs)
    ]
    for spec, starts in (*((spec, effort.starts) for spec in specs), (lever, effort.lever_starts)):
        tasks += [Task(problem=spec, solver=IPOPT, run=k) for k in range(starts)]
    return tasks


def make_spec(problem: str, effort: NaoEffort) -> ProblemSpec:
    """Return a phase of the paper."""
    return ProblemSpec(name=problem, options={"intervals": effort.intervals})


def run_and_store_points(folder: Path, task: Task, start: RunRecord | None = None) -> RunRecord:
    """Perform a run, and store every feasible solution that a search evaluated, see ``load_points``."""
    if not task.is_search:
        return run_task(task, start)
    feasible: list[tuple[Array, Array]] = []

    def add_feasible(X: Array, f: Array, violation: Array) -> None:
        good = violation == 0.0
        feasible.append((X[good], f[good]))

    record = run_task(task, callback=add_feasible)
    x, power = (np.concatenate(arrays) for arrays in zip(*feasible, strict=True))
    Store(folder).save_arrays(_name_points(task), task.definition(), {"x": x, "power_W": power})
    return record


def load_points(store: Store, task: Task) -> tuple[Array, Array] | None:
    """Return the feasible solutions of a search: x (m, n) and power (m,) [W]; None if they are not stored."""
    arrays = store.load_arrays(_name_points(task), task.definition())
    return None if arrays is None else (arrays["x"], arrays["power_W"])


def _name_points(task: Task) -> str:
    return f"points/{task.problem.title}-{task.title}-{task.run:02d}"


def make_special_sweeps(effort: NaoEffort) -> list[Computation]:
    """Return IPOPT over the paper's swing heights, and over durations of single support."""
    spec, starts = make_spec(SSP.problem, effort), effort.sweep_starts
    return [
        make_sweep(SWING_SWEEP, spec, SWING_HEIGHT, PAPER.swing_heights_m, starts),
        make_sweep(DURATION_SWEEP, spec, SSP.duration, PAPER.durations_s, starts),
    ]


def make_sweep(name: str, spec: ProblemSpec, position: int, values: Sequence[float], starts: int) -> Computation:
    """Return a sweep over a variable: its optima lead to each other, so they are not runs by themselves."""
    variable = spec.load().names[position]
    return make_computation(
        name, spec, partial(solve_sweep, spec), variable=variable, values=list(values), starts=starts
    )


def solve_sweep(
    spec: ProblemSpec, variable: str, values: Sequence[float], starts: int
) -> list[dict[str, float | bool]]:
    """Return the fields of ``SweepPoint`` at ascending values, infeasible points included."""
    problem = spec.load()
    solutions = solve_both_ways([problem.fix(**{variable: value}) for value in values], starts=starts)
    return [
        {"at": value, "power_W": solution.objective, "feasible": solution.converged}
        for value, solution in zip(values, solutions, strict=True)
    ]


def compute_power_with_legs_twice(problem: GaitProblem, x: Sequence[float]) -> float:
    """Return the power with the mechanical term of the moving leg joints counted twice [W]; see the note in the report."""
    signals = problem.signals(problem.check_x(x))
    legs = [i for i, joint in enumerate(signals.joints) if joint in PLANNED_JOINTS]
    mechanical = np.abs(signals.arrays["tau"] * signals.arrays["qd"])[:, legs].sum(axis=1)
    mean = np.trapezoid(mechanical, signals.arrays["t"]) / signals.arrays["t"][-1]
    return float(evaluate(problem, x).objective["value"] + mean)
