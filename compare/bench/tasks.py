"""What is run on the suite: every instance, a number of runs with the same seeds for all, one budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from compare.study.task import ProblemSpec, Stop, Task
from metaheuristics.interface import Algorithm

# The rules of GaitBench 1: who keeps to them can be compared with what is shipped.
RUNS = 15
EVALUATIONS = 10_000  # as in the papers: 50 candidates, 200 generations
SEED = 0

# Solvers of the shipped baseline.
BASELINE = (
    "random",
    "pso",
    "ga",
    "aco",
    "aco-grid",
    "cma",
    "de",
    "pymoo:GA",
    "pymoo:DE",
    "pymoo:ISRES",
    "slsqp",
    "ipopt",
)


def instance_spec(id: str) -> ProblemSpec:
    """An instance as a study knows it."""
    return ProblemSpec(name="gaitbench", options={"instance": id}, label=id)


def bench_tasks(
    instances: Sequence[str],
    solver: str | Algorithm,
    *,
    settings: Mapping[str, Any] | None = None,
    label: str = "",
    runs: int = RUNS,
    evaluations: int = EVALUATIONS,
    time_limit_s: float | None = None,
) -> tuple[Task, ...]:
    """Every run of a solver on some instances."""
    return tuple(
        Task(
            problem=instance_spec(id),
            solver=solver,
            settings=settings or {},
            label=label,
            stop=Stop(evaluations=evaluations, time_limit_s=time_limit_s),
            seed=SEED,
            run=run,
        )
        for id in instances
        for run in range(runs)
    )
