"""Runs of the reproduction of the 12-joint walk, and two paths of neighbouring optima."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers.paper_runs import Effort, Runs, choose_best, make_computation, make_search_tasks, make_start_tasks
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3, TABLE_4, PaperRow
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from metaheuristics import GeneticAlgorithm, ParticleSwarm
from metaheuristics.algorithms.genetic import Flip
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import Continuation, solve
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.walk12.walk12_model import Zmp
from nlp_gait.gaits.walk12.walk12_problem import VARIABLES, Horizon

PAPER, MODEL = "paper", "model"  # whose f1max
HORIZONS: tuple[Horizon, ...] = get_args(Horizon)
# Table II: 30 epochs after the first population.
GA, GA_EVALUATIONS = GeneticAlgorithm.goswami2008(), 930
CORNER_M = 0.13
BENT_FREELY_WEIGHTS = (0.15, 0.9, 1.0)
# Other readings of the ZMP, with the lambda at which IPOPT solves: all of Table III by the equations that the paper prints.
READINGS: Mapping[Zmp, Sequence[float]] = {
    "moment-free": (0.15, 1.0),
    "appendix": (0.15, 1.0),
    "appendix-as-printed": tuple(row.weight for row in TABLE_3),
}
BELOW_WEIGHT = 0.05  # the paper: the robot falls below lambda = 0.1
# What Table II leaves open: settings of the GA other than ours, at lambda = 0.15.
GA_VARIANTS = {
    "ga-no-elite": replace(GA, elites=0),
    "ga-tournament-3": replace(GA, tournament=3),
    "ga-plus": replace(GA, survival="plus"),
    "ga-chromosome": replace(GA, mutation=Flip(probability=0.1 / len(VARIABLES))),
}
VARIANTS_WEIGHT = 0.15


@dataclass(frozen=True, kw_only=True)
class Walk12Effort(Effort):
    """Effort of the reproduction of the 12-joint walk."""

    starts: int = 20  # of IPOPT on each problem
    runs: int = 10  # of each search
    pso_evaluations: int = 10_000  # the GA has the paper's
    # Of the trade-off curve, dense where the optimum moves from one plateau to the other.
    weights: tuple[float, ...] = tuple(
        np.unique(np.round([*np.linspace(0, 1, 21), *np.linspace(0.66, 0.78, 49)], 4)).tolist()
    )
    lengths_m: tuple[float, ...] = tuple(np.round(np.linspace(0.05, 0.13, 33), 6).tolist())  # steps of the Pareto front
    printed_step_weights: tuple[float, ...] = (0.15, 0.9, 1.0)  # solved with the paper's integration step

    @property
    def steps(self) -> int:
        """Runs, the two paths, the printed integration step, and the report."""
        table_3, table_4 = len(TABLE_3) * (self.starts + 2 * self.runs), len(TABLE_4) * len(HORIZONS) * self.starts
        variants = sum(map(len, READINGS.values())) + len(BENT_FREELY_WEIGHTS) + len(TABLE_3) + 1
        searches = len(GA_VARIANTS) + 2 * len(TABLE_4) * len(HORIZONS)
        runs = 2 * (table_3 + table_4) + variants * self.starts + searches * self.runs + 1
        return runs + 2 + 1 + 1


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """Optimum at a weight or step length [m] of a path: s [m], Q [m^2 s] and IPOPT's iterations."""

    at: float
    step_length_m: float
    Q_m2s: float
    iterations: int


def title_table_3(label: str, weight: float) -> str:
    """Return the title of a row of Table III under a normalisation."""
    return f"table3-{label}-{weight:g}"


def title_table_4(row: PaperRow, horizon: Horizon, most_stable: bool = False) -> str:
    """Return the title of a row of Table IV under a horizon of Q: its optimum, or its most stable gait, which gives f1max."""
    return f"table4-{row.step_time_s:g}s-Q{horizon}" + "-stable" * most_stable


@cache
def load_walk12(**options: str) -> GaitProblem:
    """Return the problem with its default parameters."""
    return ProblemSpec(name="walk12", options=options).load()


def make_first_tasks(effort: Walk12Effort) -> Iterator[Task]:
    """Yield Table III under the paper's f1max, the most stable gaits of Table IV, and the runs for the errata."""
    yield from _make_table_3(effort, PAPER, F1MAX)
    for row, horizon in product(TABLE_4, HORIZONS):
        title = title_table_4(row, horizon, most_stable=True)
        most_stable = _make_spec(title, 1.0, F1MAX, {"horizon": horizon}, step_time_s=row.step_time_s)
        yield from _make_runs(effort, most_stable, "ga")
    for zmp, weights in READINGS.items():
        for weight in weights:
            yield from _make_runs(effort, _make_spec(f"{zmp}-{weight:g}", weight, F1MAX, {"zmp": zmp}))
    for weight in BENT_FREELY_WEIGHTS:
        freely = _make_spec(f"no-reach-margin-{weight:g}", weight, F1MAX, reach_margin_rad=0.0)
        yield from _make_runs(effort, freely)
    for row in TABLE_3:
        simpson = _make_spec(f"simpson-{row.weight:g}", row.weight, F1MAX, {"quadrature": "simpson"})
        yield from _make_runs(effort, simpson)
    yield from _make_runs(effort, _make_spec("below", BELOW_WEIGHT, F1MAX))
    variants = _make_spec(title_table_3(PAPER, VARIANTS_WEIGHT), VARIANTS_WEIGHT, F1MAX)
    yield from make_search_tasks(variants, GA_VARIANTS, effort.runs, GA_EVALUATIONS)
    corner = _make_spec("corner", 0.15, F1MAX)
    yield Task(problem=corner, solver=IPOPT, start=dict.fromkeys(corner.load().names, CORNER_M))


def make_second_tasks(effort: Walk12Effort, runs: Runs) -> Iterator[Task]:
    """Yield the tasks that need the model's own f1max: Table III under it, and Table IV."""
    yield from _make_table_3(effort, MODEL, find_f1max(runs, title_table_3(PAPER, 1.0)))
    for row, horizon in product(TABLE_4, HORIZONS):
        f1max = find_f1max(runs, title_table_4(row, horizon, most_stable=True))
        options, title = {"horizon": horizon}, title_table_4(row, horizon)
        yield from _make_runs(effort, _make_spec(title, row.weight, f1max, options, step_time_s=row.step_time_s), "ga")


def _make_table_3(effort: Walk12Effort, label: str, f1max: float) -> Iterator[Task]:
    for row in TABLE_3:
        yield from _make_runs(effort, _make_spec(title_table_3(label, row.weight), row.weight, f1max), "ga", "pso")


def _make_runs(effort: Walk12Effort, spec: ProblemSpec, *searches: str) -> Iterator[Task]:
    yield from make_start_tasks(spec, effort.starts)
    if "ga" in searches:
        yield from make_search_tasks(spec, {"ga": GA}, effort.runs, GA_EVALUATIONS)
    if "pso" in searches:
        yield from make_search_tasks(spec, {"pso": ParticleSwarm()}, effort.runs, effort.pso_evaluations)


def _make_spec(
    label: str, weight: float, f1max: float, options: Mapping[str, str] | None = None, **values: float
) -> ProblemSpec:
    values |= {"lambda": weight, "f1max": f1max}
    return ProblemSpec(name="walk12", options=options or {}, values=values, label=label)


def find_f1max(runs: Runs, title: str) -> float:
    """Return the model's f1 of a most stable gait [1/(m^2 s)]: with ``--set f1max=...`` its f is 1."""
    return choose_best(runs[title, IPOPT]).verdict.objective * F1MAX


@cache
def compute_f1(row: PaperRow, **options: str) -> float:
    """Return f1 of a printed gait at its step time [1/(m^2 s)]."""
    problem = load_walk12(**options).with_values(step_time_s=row.step_time_s)
    return build_exact_model(problem).at(problem.check_x(row.x), problem.p).indexes["f1_per_m2s"]


def compute_f(row: PaperRow, f1max: float, **options: str) -> float:
    """Return f of a printed gait in the model under a normalisation."""
    return row.weight * compute_f1(row, **options) / f1max + (1 - row.weight) * row.x[0] / F2MAX


def make_paths(effort: Walk12Effort) -> list[Computation]:
    """Return the weighted sum and the front: each optimum starts at the last one, so it is not a run by itself."""
    spec = ProblemSpec(name="walk12")
    return [
        make_computation("weighted-sum", spec, solve_weighted_sum, weights=effort.weights, starts=effort.starts),
        make_computation("front", spec, solve_front, lengths_m=effort.lengths_m, starts=effort.starts),
    ]


def make_printed_step(effort: Walk12Effort, optima: Mapping[float, Sequence[float]]) -> list[Computation]:
    """Return solving with the paper's integration step from the optima, by lambda."""
    starts = {f"{weight:g}": optima[weight] for weight in effort.printed_step_weights}
    return [make_computation("printed-step", ProblemSpec(name="walk12"), solve_with_printed_step, starts=starts)]


def solve_with_printed_step(starts: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the optimal f with the paper's integration step, by lambda, from these points."""
    problem = load_walk12(quadrature="runge-kutta")
    return {w: solve(problem.with_values(**{"lambda": float(w)}), x0=x).objective for w, x in starts.items()}


def solve_weighted_sum(weights: Sequence[float], starts: int) -> list[dict[str, Any]]:
    """Return the fields of ``PathPoint`` at each weight."""
    return _follow([(w, load_walk12().with_values(**{"lambda": w, "f1max": F1MAX})) for w in weights], starts)


def solve_front(lengths_m: Sequence[float], starts: int) -> list[dict[str, Any]]:
    """Return the fields of ``PathPoint`` at each step length, of the largest f1 there: the Pareto front of Q and s."""
    most_stable = load_walk12().with_values(**{"lambda": 1.0})
    return _follow([(s, most_stable.fix(step_length_m=s)) for s in lengths_m], starts)


def _follow(problems: Sequence[tuple[float, GaitProblem]], starts: int) -> list[dict[str, Any]]:
    path, found = Continuation(starts=starts), []
    for at, problem in problems:
        solution = path.solve(problem)
        Q = evaluate(problem, list(solution.x.values())).indexes["Q_m2s"]
        s = solution.x["step_length_m"]
        found.append({"at": at, "step_length_m": s, "Q_m2s": Q, "iterations": solution.iterations})
    return found
