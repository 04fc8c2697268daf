"""Measure why the gradient wins on gait problems: ``python -m docs.landscape`` writes ``docs/landscape.json``.

On NAO's single support: the exact objective and constraints around the optimum in two variables, the paths of PSO, GA, ACO and
IPOPT from start to end, how far PSO's particles still move, the effect of the budget, and that of noise on searches and on a
gradient method with finite differences. On GaitBench: the gap of the shipped runs against the number of variables.
"""

from __future__ import annotations

import json
import statistics
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize as minimise_locally

import nlp_gait
from compare.bench.leaderboard import list_baselines, load_baseline
from metaheuristics import minimize
from metaheuristics.registry import make_algorithm
from nlp_gait import gaitbench
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

PROBLEM, PAIR = "nao-ssp", ("hip_vy_start_m_s", "hip_vy_end_m_s")
SEARCHES = ("pso", "ga", "aco")
WINDOW, POINTS = 0.03, 61  # half width of the map [m/s], and points along each side
CUT = 0.004  # half width of the cut through the ridge [m/s]
BUDGET, RUNS, SEED = 30_000, 5, 0
BUDGETS = (300, 1_000, 3_000, 10_000, 30_000)
NOISES = (0.0, 1e-8, 1e-6, 1e-4, 1e-2)  # standard deviation, as a share of the objective and in units of the violation
NOISY_BUDGET, NOISY_RUNS, DIFFERENCE = 10_000, 3, 1e-7
FILE = Path(__file__).with_suffix(".json")

Array = np.ndarray[Any, np.dtype[np.float64]]
Evaluate = Callable[[Array], tuple[Array, Array]]


class Problem:
    """The problem, its optimum, and its exact functions for batches."""

    def __init__(self) -> None:
        self.gait = nlp_gait.load(PROBLEM)
        self.evaluate = nlp_gait.compile_objective(self.gait)
        self.solution = nlp_gait.solve(self.gait, starts=5, seed=SEED)
        self.best = self.gait.check_x(self.solution.x)
        self.least = self.solution.objective
        self.places = [self.gait.variable_index(name) for name in PAIR]

    def gap(self, objective: float) -> float:
        """Return the distance from the optimum, as a share of it."""
        return objective / self.least - 1.0

    def put(self, first: Array, second: Array) -> Array:
        """Return points (N, n) that differ from the optimum in the two variables (N,)."""
        X = np.tile(self.best, (first.size, 1))
        X[:, self.places] = np.stack([first.ravel(), second.ravel()], axis=1)
        return X


def map_plane(problem: Problem) -> dict[str, Any]:
    """Evaluate a grid around the optimum, and a line through it along the second variable."""
    centre = problem.best[problem.places]
    sides = [np.linspace(middle - WINDOW, middle + WINDOW, POINTS) for middle in centre]
    f, violation = problem.evaluate(problem.put(*np.meshgrid(*sides)))
    line = np.linspace(centre[1] - CUT, centre[1] + CUT, 161)
    cut_f, cut_violation = problem.evaluate(problem.put(np.full(line.size, centre[0]), line))
    shape = (POINTS, POINTS)
    return {
        "sides": [side.round(7).tolist() for side in sides],
        "power_W": f.reshape(shape).round(4).tolist(),
        "violation": violation.reshape(shape).round(5).tolist(),
        "cut": {"at": line.round(7).tolist(), "power_W": cut_f.tolist(), "violation": cut_violation.tolist()},
        "optimum": centre.tolist(),
    }


def run_search(problem: Problem, name: str, seed: int, budget: int, evaluate: Evaluate) -> tuple[Any, list[Array]]:
    """Return the result of a search and its generations."""
    generations: list[Array] = []
    result = minimize(
        evaluate,
        make_algorithm(name),
        evaluations=budget,
        seed=seed,
        callback=lambda X, f, violation: generations.append(X.copy()),
    )
    return result, generations


def trace_searches(problem: Problem) -> dict[str, Any]:
    """Return the best point after each generation in the plane, how far particles move, and the gap after each budget."""
    found: dict[str, Any] = {}
    for name in SEARCHES:
        gaps: dict[int, list[float]] = {budget: [] for budget in BUDGETS}
        for seed in range(RUNS):
            result, generations = run_search(problem, name, seed, BUDGET, problem.evaluate)
            for budget in BUDGETS:
                at = int(np.searchsorted(result.history.evaluations, budget, side="right")) - 1
                feasible = at >= 0 and result.history.violation[at] <= FEASIBILITY_TOLERANCE
                gaps[budget].append(problem.gap(result.history.objective[at]) if feasible else np.inf)
            if seed == SEED:
                path = follow_best(problem, generations)
                size = problem.gait.upper - problem.gait.lower
                moves = [
                    float(np.median(np.abs(b - a) / size))
                    for a, b in zip(generations, generations[1:], strict=False)
                    if a.shape == b.shape
                ]
                found[name] = {"path": path, "moves": [float(f"{move:.3g}") for move in moves]}
        found[name]["gap"] = {budget: statistics.median(values) for budget, values in gaps.items()}
    return found


def follow_best(problem: Problem, generations: list[Array]) -> list[list[float]]:
    """Return the two variables of the best point so far, after each generation that improves it."""
    path, best = [], (np.inf, np.inf)
    for X in generations:
        f, violation = problem.evaluate(X)
        i = min(range(len(X)), key=lambda k: (violation[k], f[k]))
        if (violation[i], f[i]) < best:
            best = float(violation[i]), float(f[i])
            path.append([*X[i, problem.places].round(6).tolist(), problem.gap(best[1]) if best[0] == 0.0 else None])
    return path


def trace_ipopt(problem: Problem) -> list[list[float | None]]:
    """Return the two variables after each iteration of IPOPT from a random start, by stopping it ever later."""
    x0 = problem.gait.start_point(np.random.default_rng(SEED))
    exact, path = build_exact_model(problem.gait), []
    most = nlp_gait.solve(problem.gait, x0=x0, solver=IpoptSettings()).best.iterations
    for iterations in [*range(1, most), 300]:
        x = nlp_gait.solve(problem.gait, x0=x0, solver=IpoptSettings(iterations=iterations), workers=1).x
        values = exact.at(problem.gait.check_x(x), problem.gait.p)
        feasible = values.violation <= FEASIBILITY_TOLERANCE
        path.append([*(x[name] for name in PAIR), problem.gap(values.cost) if feasible else None])
    return path


class Noisy:
    """The exact functions with Gaussian noise on the objective and on the violation of violated constraints."""

    def __init__(self, problem: Problem, share: float, seed: int) -> None:
        self.names, self.lower, self.upper = problem.gait.names, problem.gait.lower, problem.gait.upper
        self._exact, self._share, self._rng = problem.evaluate, share, np.random.default_rng([seed, int(1e9 * share)])

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return objectives (P,) and violations (P,) of points (P, n)."""
        f, violation = self._exact(X)
        noise = self._share * self._rng.standard_normal((2, len(X)))
        return f * (1.0 + noise[0]), np.abs(violation + noise[1] * (violation > 0.0))


def compare_under_noise(problem: Problem) -> list[dict[str, Any]]:
    """Return the true gap of noisy searches and of SLSQP with finite differences of the same noisy functions."""
    rows = []
    for share in NOISES:
        gaps: dict[str, list[float]] = {}
        for seed in range(NOISY_RUNS):
            evaluate = Noisy(problem, share, seed)
            for name in (*SEARCHES, "cma"):
                result, _ = run_search(problem, name, seed, NOISY_BUDGET, evaluate)
                gaps.setdefault(name, []).append(judge(problem, result.x))
            gaps.setdefault("slsqp", []).append(judge(problem, descend(problem, evaluate, seed)))
        rows.append({"noise": share, **{name: statistics.median(values) for name, values in gaps.items()}})
        print(rows[-1], flush=True)
    return rows


def judge(problem: Problem, x: Array) -> float:
    """Return the true gap of a point, infinite if it is infeasible."""
    f, violation = problem.evaluate(np.asarray(x)[None])
    return problem.gap(float(f[0])) if violation[0] <= FEASIBILITY_TOLERANCE else np.inf


def descend(problem: Problem, evaluate: Evaluate, seed: int) -> Array:
    """Return the end of SLSQP with finite differences, from the first feasible point of a random sample."""
    gait, rng = problem.gait, np.random.default_rng(seed)
    size = gait.upper - gait.lower
    X = gait.lower + size * rng.random((1000, len(size)))
    f, violation = problem.evaluate(X)
    start = (X[np.lexsort((f, violation))[0]] - gait.lower) / size

    def read(kind: int, u: Array) -> float:
        return float(evaluate((gait.lower + size * np.clip(u, 0.0, 1.0))[None])[kind][0])

    end = minimise_locally(
        partial(read, 0),
        start,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(size),
        constraints={"type": "ineq", "fun": lambda u: -read(1, u)},
        options={"maxiter": 300, "eps": DIFFERENCE},
    )
    return gait.lower + size * np.clip(end.x, 0.0, 1.0)


def collect_dimensions() -> list[dict[str, Any]]:
    """Return variables, and the median gaps of GaitBench's shipped runs of 10,000 evaluations."""
    rows = []
    for id in list_baselines():
        instance = gaitbench.load(id)
        costs: dict[str, list[float]] = {}
        for record in load_baseline(id):
            cost = instance.gait_problem.objective.sign * record.objective
            gap = max(cost - instance.best_known, 0.0) / abs(instance.best_known)
            costs.setdefault(record.solver, []).append(gap if record.feasible else np.inf)
        rows.append({"id": id, "n": len(instance.names), **{s: statistics.median(v) for s, v in costs.items()}})
    return rows


def main() -> None:
    """Measure everything and write the file."""
    problem = Problem()
    data = {
        "problem": PROBLEM,
        "pair": PAIR,
        "power_W": problem.least,
        "ipopt_calls": problem.solution.evaluations.f,
        "budget": BUDGET,
        "runs": RUNS,
        "plane": map_plane(problem),
        "searches": trace_searches(problem),
        "ipopt": trace_ipopt(problem),
        "noise": compare_under_noise(problem),
        "dimensions": collect_dimensions(),
    }
    text = json.dumps(data, default=float).replace("Infinity", "null").replace("NaN", "null")
    FILE.write_text(text + "\n", encoding="utf-8")
    print(f"wrote {FILE}")


if __name__ == "__main__":
    main()
