"""Gaits to simulate: optimal cycles, the papers' gaits and our optima, random feasible ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

import nlp_gait
from compare.questions.question import find
from compare.questions.sweep import Axis, Sweep, SweepPoint
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result

# Forward and to the left.
DIRECTIONS = {"forward": (1, 0), "backward": (-1, 0), "left": (0, 1), "right": (0, -1)}
# Gupta, Pratihar, Deb (2023), Tables 6 and 8.
PAPER = {
    "nao-ssp": {
        "paper's PSO": (0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4),
        "paper's GA": (0.31, -0.005, 0, 0.0031, 0.0017, 0.0364, -0.0135, 0.015, 4),
    },
    "nao-dsp": {
        "paper's PSO": (0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 2),
        "paper's GA": (0.31, 0.0002, -0.0052, 0.0582, 0.001, -0.0384, -0.0405, 2),
    },
}
SPEEDS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1)  # [m/s]
DRAWS, BATCH = 100, 20_000  # candidates of random gaits: at most DRAWS batches


@cache
def optimal_cycles(speeds: Sequence[float] = SPEEDS, **options: Any) -> Mapping[float, Result]:
    """Return the cheapest cycle at each speed [m/s], as ``nlp-gait sweep``."""
    problem = nlp_gait.load("nao-cycle", objective="power", **options)
    axis = Axis(name="speed_m_s", values=tuple(speeds))
    points = find(Sweep(problem=problem, axes=[axis], starts=3))
    return {point.at[axis.name]: _place(problem, point) for point in points if point.feasible}


def _place(problem: GaitProblem, point: SweepPoint) -> Result:
    placed = problem.place(point.at)
    return Result(problem=placed, x=placed.check_x(point.x))


@cache
def optimum(name: str, **options: Any) -> Result:
    """Return the best of five starts of IPOPT."""
    problem = nlp_gait.load(name, **options)
    solution = nlp_gait.solve(problem, starts=5, seed=0)
    return Result(problem=problem, x=problem.check_x(solution.x))


def phase_gaits(name: str) -> dict[str, Result]:
    """Return the optimum of a phase, in double support also with the lever rule, and the paper's gaits."""
    problem = nlp_gait.load(name)
    found = {"optimum": optimum(name)}
    if name == "nao-dsp":
        found["optimum, lever rule"] = optimum(name, torso_share="lever")
    return found | {label: Result(problem=problem, x=problem.check_x(x)) for label, x in PAPER[name].items()}


def random_gaits(problem: GaitProblem, count: int, seed: int = 0) -> list[Result]:
    """Draw points uniformly within the bounds and return feasible ones.

    Raises:
        InputError: too few were feasible.
    """
    objective, rng = compile_objective(problem), np.random.default_rng(seed)
    found: list[Result] = []
    for _ in range(DRAWS):
        candidates = rng.uniform(problem.lower, problem.upper, (BATCH, len(problem.names)))
        _, violation = objective(candidates)
        found += [Result(problem=problem, x=x) for x in candidates[violation == 0.0]]
        if len(found) >= count:
            return found[:count]
    raise InputError(
        f"{len(found)} of {DRAWS * BATCH} random gaits of {problem.name!r} are feasible, of {count} required"
    )
