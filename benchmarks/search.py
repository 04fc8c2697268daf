"""Rows about whole searches: this package's PSO against pymoo's, on the same kernel and on NumPy with Pinocchio."""

from __future__ import annotations

import numpy as np
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.problem import Problem
from pymoo.optimize import minimize as pymoo_minimize

import nlp_gait
from benchmarks.by_hand import ByHand
from benchmarks.rows import Row, ratio, side_by_side
from metaheuristics import ParticleSwarm, minimize
from metaheuristics.interface import BatchObjective

EVALUATIONS, POPULATION = 10_000, 50
SLOW_PART = 20  # the slowest path runs this part of the generations


class PymooProblem(Problem):
    """A batch objective as pymoo wants it."""

    def __init__(self, objective: BatchObjective) -> None:
        super().__init__(n_var=len(objective.lower), n_obj=1, n_ieq_constr=1, xl=objective.lower, xu=objective.upper)
        self.objective = objective

    def _evaluate(self, X: np.ndarray, out: dict[str, np.ndarray], *_: object, **__: object) -> None:
        out["F"], out["G"] = (values[:, None] for values in self.objective(X))


def swarms(rounds: int) -> list[Row]:
    """50 particles, 200 generations."""
    objective = nlp_gait.compile_objective(nlp_gait.load("nao-ssp"), require_compiler=True, threads=1)
    by_hand = ByHand()

    def ours() -> object:
        return minimize(objective, ParticleSwarm(), evaluations=EVALUATIONS, seed=0)

    def pymoo(target: Problem, generations: int) -> object:
        return pymoo_minimize(target, PSO(pop_size=POPULATION), ("n_gen", generations), seed=0, verbose=False)

    fast, slow = PymooProblem(objective), PymooProblem(by_hand)
    generations = EVALUATIONS // POPULATION
    times = side_by_side(
        {
            "ours": ours,
            "pymoo": lambda: pymoo(fast, generations),
            "pymoo by hand": lambda: pymoo(slow, generations // SLOW_PART),
        },
        rounds,
    )
    return [
        Row(name="PSO 50 x 200", value=float(np.median(times["ours"])) * 1e3, unit="ms"),
        Row(
            name="PSO against pymoo's on the same kernel",
            value=ratio(times["pymoo"], times["ours"]),
            unit="x",
            required=15,
            ambition=25,
        ),
        Row(
            name="PSO against pymoo's on NumPy and Pinocchio",
            value=ratio(times["pymoo by hand"], times["ours"], SLOW_PART),
            unit="x",
            note=f"extrapolated from {generations // SLOW_PART} generations",
        ),
    ]
