"""Computations behind the reproduction of the 12-joint walk; results are plain data that can be kept as JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, get_args

import numpy as np

import metaheuristics
import nlp_gait
from compare.judge import evaluate
from compare.papers.walk12.paper import TABLE_4
from compare.study.steps import Steps, fingerprint
from metaheuristics import Algorithm, GeneticAlgorithm, ParticleSwarm
from nlp_gait.backends.optima.continuation import Continuation
from nlp_gait.problem import GaitProblem
from nlp_gait.problems.walk12.model import Zmp
from nlp_gait.problems.walk12.problem import Horizon

HORIZONS: tuple[Horizon, ...] = get_args(Horizon)
STARTS = 20
RUNS = 10
# Table II: 30 epochs after the first population.
GA, GA_EVALUATIONS = GeneticAlgorithm.goswami2008(), 930
PSO, PSO_EVALUATIONS = ParticleSwarm(), 10_000
SAME_OPTIMUM = 2e-4  # starts whose f differs by less agree

# Weights of the trade-off curve: dense where the optimum moves from one plateau to the other.
SWEEP_WEIGHTS = tuple(np.unique(np.round([*np.linspace(0, 1, 21), *np.linspace(0.66, 0.78, 49)], 4)).tolist())
FRONT_LENGTHS_M = tuple(np.round(np.linspace(0.05, 0.13, 33), 6).tolist())

Run = dict[str, Any]


@cache
def walk(horizon: Horizon = "step", zmp: Zmp = "exact") -> GaitProblem:
    """Problem with its default parameters, built once."""
    return nlp_gait.load("walk12", horizon=horizon, zmp=zmp)


def weighted(weight: float, f1max: float, problem: GaitProblem | None = None) -> GaitProblem:
    """Problem at a lambda under a normalisation."""
    return (problem or walk()).with_values(**{"lambda": weight, "f1max": f1max})


def best_by_ipopt(problem: GaitProblem) -> Run:
    """Best of random starts, as the judge finds it, with how many starts agree."""
    solution = nlp_gait.solve(problem, starts=STARTS, seed=0)
    x = list(solution.x.values())
    agreeing = sum(s.success and abs(s.objective - solution.objective) < SAME_OPTIMUM for s in solution.starts)
    times = [start.time_s for start in solution.starts]
    return {**judged(problem, x), "status": solution.status, "agreeing": agreeing, "time_s": float(np.median(times))}


def best_by_search(problem: GaitProblem, algorithm: Algorithm, evaluations: int) -> Run:
    """Best, median and worst f over seeds; x and the judge's dense value of the best run; best so far of every run."""
    objective = nlp_gait.compile_objective(problem)
    runs = [metaheuristics.minimize(objective, algorithm, evaluations=evaluations, seed=seed) for seed in range(RUNS)]
    f = np.array([-run.objective if run.feasible else -np.inf for run in runs])
    best = runs[int(f.argmax())]
    spread = {"best": float(f.max()), "median": float(np.median(f)), "worst": float(f.min())}
    histories = [[float(-v) if np.isfinite(v) else None for v in run.history.objective] for run in runs]
    times = {"time_s": float(np.median([run.time_s for run in runs]))}
    return {**judged(problem, best.x.tolist()), **spread, **times, "histories": histories}


def judged(problem: GaitProblem, x: Iterable[float]) -> Run:
    """A gait as the judge finds it, on its own samples and on the dense grid."""
    verdict = evaluate(problem, list(x))
    return {
        "x": list(verdict.x.values()),
        "f": verdict.objective["value"],
        "feasible": verdict.feasible,
        "dense": dict(verdict.dense or {}),
        "dense_violation": max((row.violation for row in verdict.dense_violations), default=0.0),
    }


def model_f1max(problem: GaitProblem) -> float:
    """Largest f1 of the model [1/(m^2 s)]: the problem at lambda = 1, solved by IPOPT from several starts.

    With ``--set f1max=...`` it is the second normalisation: f of the most stable gait is then 1.
    """
    scale = problem.value("f1max")
    solution = nlp_gait.solve(problem.with_values(**{"lambda": 1.0}), starts=STARTS, seed=0)
    return solution.objective * scale


def table_3_runs(steps: Steps, label: str, weight: float, f1max: float) -> dict[str, Run]:
    """IPOPT, GA and PSO at one lambda under one normalisation."""
    problem = weighted(weight, f1max)
    solvers: dict[str, Callable[[], Run]] = {
        "ipopt": lambda: best_by_ipopt(problem),
        "ga": lambda: best_by_search(problem, GA, GA_EVALUATIONS),
        "pso": lambda: best_by_search(problem, PSO, PSO_EVALUATIONS),
    }
    settings = {"starts": STARTS, "runs": RUNS, "ga": repr(GA), "pso": repr(PSO), "pso_evaluations": PSO_EVALUATIONS}
    inputs = {**fingerprint(problem), **settings}
    return {
        name: steps(f"table3-{label}-{weight:g}-{name}", {**inputs, "solver": name}, run)
        for name, run in solvers.items()
    }


def table_4_runs() -> list[Run]:
    """For every row and horizon: f1 of the paper's gait, the model's f1max, and the optimum under it."""
    found = []
    for row in TABLE_4:
        for horizon in HORIZONS:
            problem = walk(horizon).with_values(step_time_s=row.step_time_s)
            f1max = model_f1max(problem)
            optimum = best_by_ipopt(weighted(row.weight, f1max, problem))
            paper_f1 = judged(problem, row.x)["dense"]["f1_per_m2s"]
            at = {"step_time_s": row.step_time_s, "horizon": horizon, "implied_f1": row.implied_f1}
            found.append({**at, "paper_f1": paper_f1, "f1max": f1max, "optimum": optimum})
    return found


def weighted_sum(f1max: float) -> list[Run]:
    """Optimum at every weight, each from the end of the last one."""
    path = Continuation(starts=STARTS)
    return [_tradeoff(path, weighted(weight, f1max), weight=weight) for weight in SWEEP_WEIGHTS]


def front() -> list[Run]:
    """Largest f1 at every step length, each from the end of the last one: the Pareto front of Q and s."""
    path = Continuation(starts=STARTS)
    most_stable = walk().with_values(**{"lambda": 1.0})
    return [_tradeoff(path, most_stable.fix(step_length_m=s), step_length_m=s) for s in FRONT_LENGTHS_M]


def _tradeoff(path: Continuation, problem: GaitProblem, **at: float) -> Run:
    solution = path.solve(problem)
    verdict = evaluate(problem, list(solution.x.values()))
    return {
        **at,
        "success": solution.success,
        "x": list(solution.x.values()),
        "f": solution.objective,
        "Q_m2s": verdict.indexes["Q_m2s"],
        "dense_Q_m2s": (verdict.dense or {})["Q_m2s"],
        "iterations": solution.iterations,
    }
