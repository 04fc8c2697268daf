"""What the adapter to pymoo costs: its GA on an instance against the same GA on a Problem written by hand.

``python -m benchmarks adapter``; both problems call the same compiled kernel, and both runs end at the same point.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from benchmarks.rows import Row, ratio, side_by_side
from nlp_gait import gaitbench
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective

POPULATION, GENERATIONS = 100, 100


class ByHand(Problem):
    """Wrapper that a user would write around the kernel."""

    def __init__(self, objective: CompiledObjective) -> None:
        super().__init__(n_var=len(objective.lower), n_obj=1, n_ieq_constr=1, xl=objective.lower, xu=objective.upper)
        self.objective = objective

    def _evaluate(self, X: np.ndarray, out: dict[str, np.ndarray], *_: Any, **__: Any) -> None:
        out["F"], out["G"] = (values[:, None] for values in self.objective(X))


def adapter(rounds: int, id: str = "ssp-v5") -> list[Row]:
    """Ratio of times, and whether both find the same."""
    instance = gaitbench.load(id)
    problems = {
        "adapter": instance.to("pymoo"),
        "by hand": ByHand(compile_objective(instance.gait_problem, require_compiler=True)),
    }
    ends: dict[str, Any] = {}

    def run(name: str) -> None:
        ends[name] = minimize(problems[name], GA(pop_size=POPULATION), ("n_gen", GENERATIONS), seed=0, verbose=False)

    times = side_by_side({name: lambda name=name: run(name) for name in problems}, rounds)
    assert np.array_equal(ends["adapter"].X, ends["by hand"].X)
    return [
        Row(
            name=f"pymoo's GA on our object against by hand, {id}",
            value=ratio(times["adapter"], times["by hand"]),
            unit="x",
            required=1.05,
            at_most=True,
            note=f"{POPULATION} x {GENERATIONS}, the same end",
        )
    ]
