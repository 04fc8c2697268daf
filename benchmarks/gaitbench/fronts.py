"""Solve the true fronts of the instances with two objectives: ``python -m benchmarks.gaitbench.fronts [ID ...]``.

Each front is followed by IPOPT in both directions, with random starts at every third point, and every point is judged by the
exact functions. The points go into ``nlp_gait/gaitbench/front_points.json``; a front that is solved again replaces its points.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from casadi import MX

from compare.questions.pareto.front import solve_front
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, Assembly, GaitProblem, Point
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Solution
from nlp_gait.gaitbench.fronts import LIMIT, SECOND, UNLIMITED, FrontInstance, get_front_definition, list_fronts

FILE = Path(__file__).parents[2] / "nlp_gait" / "gaitbench" / "front_points.json"
POINTS, STARTS = 40, 3


@dataclass(frozen=True, kw_only=True)
class SecondObjective:
    """The second objective as a quantity whose least value can be demanded; see ``compare.questions.pareto.competing``."""

    unit: str
    name: str = SECOND

    def get_demand(self, problem: GaitProblem) -> float:
        """Return the least value that the problem demands."""
        return -problem.value(LIMIT)

    def drop_demand(self, problem: GaitProblem) -> GaitProblem:
        """Return the problem without a demand."""
        return problem.with_values(**{LIMIT: UNLIMITED})

    def demand(self, problem: GaitProblem, least: float) -> GaitProblem:
        """Return the problem with a least value."""
        return problem.with_values(**{LIMIT: -least})

    def evaluate(self, problem: GaitProblem, x: Array) -> float:
        """Return the exact value at x (n,)."""
        exact = build_exact_model(problem)
        return -float(exact.at(x, problem.p).g[list(exact.row_names).index(SECOND)])

    def express(self, point: Point, assembly: Assembly) -> MX:
        """Return a scalar for the assembly of a problem."""
        return -assembly.group(SECOND).value

    def compute_price(self, solution: Solution) -> float:
        """Return no price: the benchmark has no use for it."""
        return 0.0


def main() -> None:
    """Solve the fronts that are named, or all that are missing; judge all."""
    for id in sys.argv[1:] or [id for id in list_fronts() if id not in json.loads(FILE.read_text())]:
        begin, definition = time.process_time(), get_front_definition(id)
        problem = definition.make()
        front = solve_front(problem, SecondObjective(unit=definition.unit), points=POINTS, starts=STARTS)  # type: ignore[arg-type]
        good = [point for point in front if point.violation <= FEASIBILITY_TOLERANCE]
        known = json.loads(FILE.read_text())  # others may be solved beside this one
        known[id] = [list(point.x) for point in good]
        lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(points)}" for name, points in sorted(known.items()))
        FILE.write_text(f"{{\n{lines}\n}}\n")
        ends = np.array([(point.power_W, point.value) for point in good])
        print(
            f"{id}: {len(good)} of {len(front)} points, {ends[0]} to {ends[-1]}, {time.process_time() - begin:.0f} s",
            flush=True,
        )
    for id in json.loads(FILE.read_text()):
        instance = FrontInstance(id)
        first, second = np.diff(instance.front, axis=0).T
        worst = instance.front_violation.max()
        nondominated = bool((first > 0).all() and (second < 0).all())
        print(
            f"{id}: {len(instance.front)} points, largest violation {worst:.1e}, none betters another: {nondominated}",
            flush=True,
        )


if __name__ == "__main__":
    main()
