"""One run of one solver on one problem, from plain data to a record."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import metaheuristics
import nlp_gait
from compare.judge import evaluate
from compare.record import History, RunRecord, Verdict
from nlp_gait.backends.solution import Solution
from nlp_gait.errors import unknown
from nlp_gait.problems.gait_problem import GaitProblem

IPOPT = "ipopt"


def solver_names() -> tuple[str, ...]:
    """Names of all solvers that a study can run."""
    return (IPOPT, *metaheuristics.ALGORITHMS)


@dataclass(frozen=True, kw_only=True)
class ProblemSpec:
    """A problem as plain data, so that it can cross process borders."""

    name: str
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)

    def load(self) -> GaitProblem:
        """The problem, built once in each process."""
        return _load(self.name, tuple(sorted(self.options.items()))).with_values(**self.values)


@lru_cache(maxsize=16)
def _load(name: str, options: tuple[tuple[str, Any], ...]) -> GaitProblem:
    return nlp_gait.load(name, **dict(options))


@dataclass(frozen=True, kw_only=True)
class Task:
    """One run as plain data.

    Attributes:
        problem: what is solved.
        algorithm: name of the solver.
        settings: of the algorithm, where they differ from its defaults.
        evaluations: budget; IPOPT has none, one of its runs is one start.
        seed: of the study.
        run: number of the run; its own seed is ``seed + run``, so that equal runs of all algorithms start alike.
    """

    problem: ProblemSpec
    algorithm: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    evaluations: int = 10_000
    seed: int = 0
    run: int = 0

    @property
    def run_seed(self) -> int:
        """Seed that repeats this run alone."""
        return self.seed + self.run


def check_task(task: Task) -> None:
    """Raise now what would fail later: unknown problem, option, parameter, algorithm or setting."""
    task.problem.load()
    if task.algorithm not in solver_names():
        raise unknown("algorithm", task.algorithm, solver_names())
    if task.algorithm != IPOPT:
        metaheuristics.algorithm(task.algorithm, **task.settings)
    else:
        nlp_gait.IpoptSettings(**task.settings)


def run_task(task: Task, observe: Callable[..., None] | None = None) -> RunRecord:
    """Do one run and judge it.

    Args:
        task: what to run.
        observe: called with X, f, violation of every generation (search algorithms only).
    """
    problem = task.problem.load()
    if task.algorithm == IPOPT:
        return _gradient_run(problem, task)
    return _search_run(problem, task, observe)


def _gradient_run(problem: GaitProblem, task: Task) -> RunRecord:
    settings = nlp_gait.IpoptSettings(**task.settings)
    solution = nlp_gait.solve(problem, starts=1, seed=task.run_seed, settings=settings)
    return record_of_solution(problem, solution, task, asdict(settings))


def record_of_solution(problem: GaitProblem, solution: Solution, task: Task, settings: Mapping[str, Any]) -> RunRecord:
    """Record of IPOPT's best start."""
    value = solution.objective if math.isfinite(solution.objective) else None
    seconds = solution.time_s.solve
    return RunRecord(
        problem=problem.name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        algorithm=task.algorithm,
        settings=settings,
        run=task.run,
        seed=task.run_seed,
        status=solution.status,
        success=solution.success,
        x=solution.x,
        objective=value,
        violation=solution.violation,
        verdict=Verdict.of(evaluate(problem, list(solution.x.values()))),
        evaluations=asdict(solution.evaluations),
        failed_evaluations=0,
        iterations=solution.iterations,
        time_s={"solve": seconds},
        history=History(
            evaluations=(solution.evaluations.f,),
            objective=(value if solution.success else None,),
            elapsed_s=(seconds,),
        ),
    )


def _search_run(problem: GaitProblem, task: Task, observe: Callable[..., None] | None) -> RunRecord:
    objective = nlp_gait.compile_objective(problem)
    algorithm = metaheuristics.algorithm(task.algorithm, **task.settings)
    result = metaheuristics.minimize(
        objective, algorithm, evaluations=task.evaluations, seed=task.run_seed, observe=observe
    )
    sign = problem.objective.sign
    history = result.history
    best = [
        sign * float(f) if v == 0.0 and math.isfinite(f) else None
        for f, v in zip(history.objective, history.violation, strict=True)
    ]
    return RunRecord(
        problem=problem.name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        algorithm=task.algorithm,
        settings={**_plain(algorithm), "evaluations": task.evaluations, "handling": _plain(result.handling)},
        run=task.run,
        seed=task.run_seed,
        status="; ".join(result.reasons),
        success=result.feasible,
        x=problem.by_name(result.x),
        objective=sign * result.objective if math.isfinite(result.objective) else None,
        violation=result.violation if math.isfinite(result.violation) else None,
        verdict=Verdict.of(evaluate(problem, result.x)),
        evaluations={"f": result.evaluations},
        failed_evaluations=result.failed_evaluations,
        iterations=result.generations,
        time_s={"solve": result.time_s, "objective": result.objective_time_s},
        history=History(
            evaluations=tuple(int(e) for e in history.evaluations),
            objective=tuple(best),
            elapsed_s=tuple(float(t) for t in history.elapsed_s),
        ),
    )


def _plain(settings: Any) -> dict[str, Any]:
    """Settings with their class name, as plain data."""
    return {"kind": type(settings).__name__, **asdict(settings)}
