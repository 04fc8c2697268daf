"""How hard each problem is, for its page in the documentation: ``python -m docs.difficulty --records FOLDER``.

For each problem, with its default options and values: the share of feasible points among uniform random ones, the cost of an
evaluation, how many starts of IPOPT and how many runs of each default search end within 0.1 % of the best point known, and that
point with the prices of what binds it. Runs are kept in the folder as those of any study, so that a stopped call continues; what
they say is kept in ``docs/difficulty.json``, problem by problem.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import nlp_gait
from compare.study.record import RunRecord
from compare.study.run import IPOPT, ProblemSpec, Run
from compare.study.study import Study, run_study
from nlp_gait.decoding import decode
from nlp_gait.files import read_json, write_json
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import ActiveConstraint

FILE = Path(__file__).with_suffix(".json")
STARTS, RUNS, EVALUATIONS = 100, 31, 10_000
SEARCHES = ("pso", "ga", "aco")
NEAR = 1e-3  # relative distance from the best known objective that counts as reaching it
POINTS = 100_000
LONGEST_S = 120.0  # of drawing random points; fewer are drawn where an evaluation takes long


@dataclass(frozen=True, kw_only=True)
class Reached:
    """What the runs of one solver come to.

    Attributes:
        runs: starts of a gradient method, or runs of a search.
        feasible: that end at a point which the judge finds feasible.
        near: that end within 0.1 % of the best known objective.
        median_gap: relative distance of the feasible ones from it; None if there are none.
    """

    runs: int
    feasible: int
    near: int
    median_gap: float | None


@dataclass(frozen=True, kw_only=True)
class Best:
    """The best point of all runs.

    Attributes:
        solver: that found it.
        objective: of the judge, in the problem's sense.
        x: by variable name.
        active_constraints: with their prices, dearest first; those of the best run of IPOPT that reaches the same objective.
    """

    solver: str
    objective: float
    x: Mapping[str, float]
    active_constraints: tuple[ActiveConstraint, ...]


@dataclass(frozen=True, kw_only=True)
class Difficulty:
    """What was measured of a problem.

    Attributes:
        best: point of all runs.
        solvers: by name.
        evaluations: budget of each run of a search.
        points: uniform random points within the bounds; 0 for a problem that no search can evaluate.
        feasible_points: how many of them are feasible.
        evaluation_us: processor time of one evaluation in a batch, on one core [us]; None where there are no points.
    """

    best: Best | None
    solvers: Mapping[str, Reached]
    evaluations: int
    points: int
    feasible_points: int
    evaluation_us: float | None


def main() -> None:
    """Measure what is asked for, problem by problem."""
    parser = argparse.ArgumentParser(prog="python -m docs.difficulty", description=__doc__.splitlines()[0])
    parser.add_argument("problems", nargs="*", default=None, help="default: all that need no option")
    parser.add_argument("--records", type=Path, required=True, help="folder for the runs; finished ones in it are kept")
    parser.add_argument("--starts", type=int, default=STARTS, help="of IPOPT")
    parser.add_argument("--runs", type=int, default=RUNS, help="of each search; 0 for none")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    for name in arguments.problems or [name for name in nlp_gait.list_problems() if name != "gaitbench"]:
        began = time.perf_counter()
        found = measured(name, arguments.records, arguments.starts, arguments.runs, arguments.jobs)
        write_json(FILE, {**read_raw(), name: asdict(found)})
        print(f"{name}: {found.solvers} ({time.perf_counter() - began:.0f} s)", flush=True)


def read_raw() -> dict[str, object]:
    """What is kept, as plain data by name of the problem."""
    return dict(read_json(FILE, "difficulty")) if FILE.exists() else {}


def difficulties() -> dict[str, Difficulty]:
    """What is kept, by name of the problem."""
    return {name: decode(Difficulty, raw, name) for name, raw in read_raw().items()}


def measured(name: str, folder: Path, starts: int, runs: int, jobs: int) -> Difficulty:
    """Run what has no record yet, and count."""
    spec = ProblemSpec(name=name)
    problem = spec.load()
    counts = {IPOPT: starts, **(dict.fromkeys(SEARCHES, runs) if problem.searchable else {})}
    tasks = [Run(problem=spec, solver=solver, number=run) for solver, n in counts.items() for run in range(n)]
    records = run_study(Study(runs=tuple(tasks), folder=folder, jobs=jobs))
    points, feasible, us = random_points(problem) if problem.searchable else (0, 0, None)
    return Difficulty(
        best=best_of(records),
        solvers=reached(records),
        evaluations=EVALUATIONS,
        points=points,
        feasible_points=feasible,
        evaluation_us=us,
    )


def cost_of(record: RunRecord) -> float:
    """Objective as it is minimised, infinite where the judge finds the point infeasible."""
    sign = record.inputs.objective.sign
    return sign * record.objective if record.feasible else math.inf


def gap(cost: float, best: float) -> float:
    """Relative distance from the best cost."""
    return (cost - best) / (abs(best) or 1.0)


def best_of(records: Sequence[RunRecord]) -> Best | None:
    """The best feasible point of all runs; prices are IPOPT's, where it comes as near as its tolerance lets it."""
    best = min(records, key=cost_of)
    if not math.isfinite(cost_of(best)):
        return None
    priced = [r for r in records if r.active_constraints and gap(cost_of(r), cost_of(best)) < 1e-6]
    prices = min(priced, key=cost_of).active_constraints if priced else ()
    return Best(solver=best.solver, objective=best.objective, x=best.x, active_constraints=prices)


def reached(records: Sequence[RunRecord]) -> dict[str, Reached]:
    """By solver, how its runs end."""
    best = min(map(cost_of, records))
    found = {}
    for solver in dict.fromkeys(record.solver for record in records):
        costs = [cost_of(record) for record in records if record.solver == solver]
        gaps = [gap(cost, best) for cost in costs if math.isfinite(cost)]
        found[solver] = Reached(
            runs=len(costs),
            feasible=len(gaps),
            near=sum(g <= NEAR for g in gaps),
            median_gap=float(np.median(gaps)) if gaps else None,
        )
    return found


def random_points(problem: GaitProblem) -> tuple[int, int, float]:
    """How many uniform random points were drawn, how many are feasible, and the processor time of an evaluation [us]."""
    objective = nlp_gait.compile_objective(problem)
    rng = np.random.default_rng(0)
    drawn, feasible, rounds = 0, 0, []
    began = time.perf_counter()
    while drawn < POINTS and time.perf_counter() - began < LONGEST_S:
        size = min(1000 if rounds else 100, POINTS - drawn)
        X = rng.uniform(problem.lower, problem.upper, (size, len(problem.names)))
        before = time.process_time()
        violation = objective(X)[1]
        rounds.append((time.process_time() - before) / size)
        drawn, feasible = drawn + size, feasible + int(np.sum(violation == 0.0))
    return drawn, feasible, round(1e6 * min(rounds), 2)


if __name__ == "__main__":
    main()
