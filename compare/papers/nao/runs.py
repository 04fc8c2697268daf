"""Computations behind the reproduction of the NAO paper; results are plain data that can be kept as JSON.

Each process builds a problem once, whatever it computes of it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import metaheuristics
import nlp_gait
from compare.judge import evaluate
from compare.study.task import ProblemSpec
from nlp_gait.backends.optima.continuation import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.files import new_file, read_bytes
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problems.nao.body import PLANNED_JOINTS

Run = dict[str, Any]


def search(problem: str, algorithm: str, seed: int, evaluations: int, points: Path) -> Run:
    """One run of a search algorithm; every feasible solution that it evaluated goes to a file.

    Args:
        problem: name.
        algorithm: name; its default settings are the paper's.
        seed: runs of different algorithms with equal seed start from the same population.
        evaluations: budget.
        points: NumPy archive to write, with x (m, n) and power_W (m,).
    """
    model = ProblemSpec(name=problem).load()
    feasible: list[tuple[Array, Array]] = []

    def keep(X: Array, f: Array, violation: Array) -> None:
        good = violation == 0.0
        feasible.append((X[good], f[good]))

    result = metaheuristics.minimize(
        nlp_gait.compile_objective(model, threads=1),
        metaheuristics.algorithm(algorithm),
        evaluations=evaluations,
        seed=seed,
        observe=keep,
    )
    write_points(points, *(np.concatenate(part) for part in zip(*feasible, strict=True)))
    best = zip(result.history.objective, result.history.violation, strict=True)
    return {
        **judged(model, result.x),
        "history_W": [float(f) if v == 0.0 else None for f, v in best],
        "time_s": result.time_s,
    }


def solve(problem: str, seed: int, options: dict[str, str] | None = None) -> Run:
    """One start of IPOPT, from a random point."""
    model = ProblemSpec(name=problem, options=options or {}).load()
    solution = nlp_gait.solve(model, starts=1, seed=seed)
    return {
        **judged(model, list(solution.x.values())),
        "success": solution.success,
        "status": solution.status,
        "iterations": solution.iterations,
        "active": [asdict(bound) for bound in solution.active_constraints],
        "time_s": solution.time_s.solve,
    }


def sweep(problem: str, variable: str, values: Sequence[float], starts: int) -> list[Run]:
    """Optimum with a variable held at each of some values, ascending; infeasible points are kept."""
    model = ProblemSpec(name=problem).load()
    path = [model.fix(**{variable: value}) for value in values]
    solutions = solve_both_ways(path, starts=starts)
    return [
        {
            "at": value,
            "power_W": solution.objective,
            "feasible": solution.success,
            "status": solution.status,
            "x": list(solution.x.values()),
        }
        for value, solution in zip(values, solutions, strict=True)
    ]


def judged(problem: GaitProblem, x: Sequence[float] | Array) -> Run:
    """A point as the judge finds it, with the worst violation between the samples if there is one."""
    verdict = evaluate(problem, x)
    return {
        "x": list(verdict.x.values()),
        "power_W": verdict.objective["value"],
        "feasible": verdict.feasible,
        "dense_violated": [f"{row.name} by {row.violation:.2g} {row.unit}" for row in verdict.dense_violations[:1]],
        "indexes": dict(verdict.indexes),
    }


def power_with_legs_twice(problem: GaitProblem, x: Sequence[float]) -> float:
    """Power if the mechanical term of the leg joints that move counted twice [W]; see the remark in the report.

    Raises:
        ValueError: the problem has no time histories.
    """
    if problem.motion is None:
        raise ValueError(f"{problem.name} has no time histories")
    signals = problem.signals(problem.check_x(x))
    legs = [i for i, joint in enumerate(signals.joints) if joint in PLANNED_JOINTS]
    mechanical = np.abs(signals.arrays["tau"] * signals.arrays["qd"])[:, legs].sum(axis=1)
    share = np.diff(signals.arrays["t"]) / signals.arrays["t"][-1]
    mean = float(np.sum(share * (mechanical[1:] + mechanical[:-1]) / 2))
    return float(judged(problem, x)["power_W"]) + mean


def read_points(path: Path) -> tuple[Array, Array]:
    """Feasible solutions of a run: x (m, n) and power (m,) [W].

    Raises:
        InputError: the archive is damaged.
    """
    content = io.BytesIO(read_bytes(path, "points"))
    try:
        with np.load(content, allow_pickle=False) as archive:
            return np.asarray(archive["x"], dtype=float), np.asarray(archive["power_W"], dtype=float)
    except Exception as error:
        # NumPy and zipfile raise a dozen kinds of errors on damaged archives.
        raise InputError(f"points {str(path)!r} cannot be read ({error}); delete it to have it made anew") from error


def write_points(path: Path, x: Array, power: Array) -> None:
    """Whole or absent, as every file of a step."""
    with new_file(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, x=x, power_W=power)
