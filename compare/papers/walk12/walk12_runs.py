"""Runs behind the reproduction of the 12-joint walk, and the two paths of neighbouring optima."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers.paper_runs import Runs, best, searches, starts
from compare.papers.walk12.walk12_paper import F1MAX, TABLE_3, TABLE_4, PaperRow
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from metaheuristics import GeneticAlgorithm, ParticleSwarm
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.optima.continuation import Continuation
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.walk12.problem import Horizon

PAPER, MODEL = "paper", "model"  # whose f1max
HORIZONS: tuple[Horizon, ...] = get_args(Horizon)
# Table II: 30 epochs after the first population.
GA, GA_EVALUATIONS = GeneticAlgorithm.goswami2008(), 930
CORNER_M = 0.13
MOMENT_FREE_WEIGHTS = (0.15, 1.0)
WEIGHTED, FRONT = "weighted-sum", "front"


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much is computed.

    Attributes:
        starts: of IPOPT on each problem.
        runs: of each search algorithm.
        pso_evaluations: of a run of PSO; the GA has the paper's.
        weights: of the trade-off curve, dense where the optimum moves from one plateau to the other.
        lengths_m: step lengths of the Pareto front.
    """

    starts: int = 20
    runs: int = 10
    pso_evaluations: int = 10_000
    weights: tuple[float, ...] = tuple(
        np.unique(np.round([*np.linspace(0, 1, 21), *np.linspace(0.66, 0.78, 49)], 4)).tolist()
    )
    lengths_m: tuple[float, ...] = tuple(np.round(np.linspace(0.05, 0.13, 33), 6).tolist())

    @property
    def steps(self) -> int:
        """Runs, the two paths, and the report."""
        table_3, table_4 = len(TABLE_3) * (self.starts + 2 * self.runs), len(TABLE_4) * len(HORIZONS) * self.starts
        return 2 * (table_3 + table_4) + len(MOMENT_FREE_WEIGHTS) * self.starts + 1 + 2 + 1


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """Optimum at a point of a path.

    Attributes:
        at: the weight, or the step length [m].
        step_length_m: s at the optimum.
        Q_m2s: Q there.
        iterations: of IPOPT.
    """

    at: float
    step_length_m: float
    Q_m2s: float
    iterations: int


def title(label: str, weight: float) -> str:
    """Title of a row of Table III under a normalisation."""
    return f"table3-{label}-{weight:g}"


def title_of_table_4(row: PaperRow, horizon: Horizon, most_stable: bool = False) -> str:
    """Title of a row of Table IV under a horizon of Q: its optimum, or its most stable gait, which gives f1max."""
    return f"table4-{row.step_time_s:g}s-Q{horizon}" + "-stable" * most_stable


def walk(**options: str) -> GaitProblem:
    """The problem with its default parameters."""
    return ProblemSpec(name="walk12", options=options).load()


def first_tasks(effort: Effort) -> Iterator[Task]:
    """Table III under the paper's f1max, the most stable gaits of Table IV, and the runs that errata are measured with."""
    yield from _table_3(effort, PAPER, F1MAX)
    for row in TABLE_4:
        for horizon in HORIZONS:
            yield from starts(_row_of_table_4(row, horizon), effort.starts)
    for weight in MOMENT_FREE_WEIGHTS:
        free = _spec(f"moment-free-{weight:g}", {"zmp": "moment-free"}, {"lambda": weight, "f1max": F1MAX})
        yield from starts(free, effort.starts)
    corner = _spec("corner", {}, {"lambda": 0.15, "f1max": F1MAX})
    yield Task(problem=corner, solver=IPOPT, start=dict.fromkeys(corner.load().names, CORNER_M))


def second_tasks(effort: Effort, runs: Runs) -> Iterator[Task]:
    """What needs the model's own f1max: Table III under it, and Table IV."""
    yield from _table_3(effort, MODEL, own_f1max(runs))
    for row in TABLE_4:
        for horizon in HORIZONS:
            yield from starts(_row_of_table_4(row, horizon, f1max_of_table_4(runs, row, horizon)), effort.starts)


def own_f1max(runs: Runs) -> float:
    """Largest f1 of the model [1/(m^2 s)]: with ``--set f1max=...`` f of the most stable gait is 1."""
    return best(runs[title(PAPER, 1.0), IPOPT]).verdict.objective * F1MAX


def f1max_of_table_4(runs: Runs, row: PaperRow, horizon: Horizon) -> float:
    """Likewise at a step time and a horizon of Q."""
    return best(runs[title_of_table_4(row, horizon, most_stable=True), IPOPT]).verdict.objective * F1MAX


def f1_of_gait(row: PaperRow, **options: str) -> float:
    """f1 of a printed gait at its step time [1/(m^2 s)], on the dense grid."""
    verdict = evaluate(walk(**options).with_values(step_time_s=row.step_time_s), row.x)
    return (verdict.dense or {})["f1_per_m2s"]


def _table_3(effort: Effort, label: str, f1max: float) -> Iterator[Task]:
    for row in TABLE_3:
        spec = _spec(title(label, row.weight), {}, {"lambda": row.weight, "f1max": f1max})
        yield from starts(spec, effort.starts)
        yield from searches(spec, "ga", GA, effort.runs, GA_EVALUATIONS)
        yield from searches(spec, "pso", ParticleSwarm(), effort.runs, effort.pso_evaluations)


def _row_of_table_4(row: PaperRow, horizon: Horizon, f1max: float | None = None) -> ProblemSpec:
    weight, normalisation = (1.0, F1MAX) if f1max is None else (row.weight, f1max)
    values = {"step_time_s": row.step_time_s, "lambda": weight, "f1max": normalisation}
    return _spec(title_of_table_4(row, horizon, most_stable=f1max is None), {"horizon": horizon}, values)


def _spec(label: str, options: dict[str, str], values: dict[str, float]) -> ProblemSpec:
    return ProblemSpec(name="walk12", options=options, values=values, label=label)


def paths(effort: Effort) -> list[Computation]:
    """The weighted sum and the front, kept as steps: each optimum begins at the end of the last one and is no run of its own."""
    computed = {WEIGHTED: (weighted_sum, effort.weights), FRONT: (front, effort.lengths_m)}
    return [
        Computation(
            name=name,
            inputs={**fingerprint(walk()), "starts": effort.starts, "at": list(at)},
            function=partial(compute, at, effort.starts),
        )
        for name, (compute, at) in computed.items()
    ]


def weighted_sum(weights: Sequence[float], count: int) -> list[dict[str, Any]]:
    """Fields of ``PathPoint`` at every weight."""
    return _follow([(w, walk().with_values(**{"lambda": w, "f1max": F1MAX})) for w in weights], count)


def front(lengths_m: Sequence[float], count: int) -> list[dict[str, Any]]:
    """Fields of ``PathPoint`` at every step length, of the largest f1 there: the Pareto front of Q and s."""
    most_stable = walk().with_values(**{"lambda": 1.0})
    return _follow([(s, most_stable.fix(step_length_m=s)) for s in lengths_m], count)


def _follow(problems: Sequence[tuple[float, GaitProblem]], count: int) -> list[dict[str, Any]]:
    path, found = Continuation(starts=count), []
    for at, problem in problems:
        solution = path.solve(problem)
        Q = evaluate(problem, list(solution.x.values())).indexes["Q_m2s"]
        s = solution.x["step_length_m"]
        found.append({"at": at, "step_length_m": s, "Q_m2s": Q, "iterations": solution.iterations})
    return found
