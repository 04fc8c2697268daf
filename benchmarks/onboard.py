"""Planning again after 1,000 changes of the parameters: ``python -m benchmarks.onboard [--changes N] [PROBLEM...]``.

``--c`` instead compares the planner in C with Python's, and ``--cold N`` the same steps with IPOPT, from N random starts
without multipliers.

Every limit and weight moves by up to 5 % of its default, independently. Each result is compared with IPOPT at its sharpest from
that result (same basin), and with IPOPT from the optimum of the defaults.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

import nlp_gait
from benchmarks import onboard_c
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.onboard.replanner import Replan, Replanner
from nlp_gait.backends.optima.optimum import SHARP
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Outcome

PROBLEMS = ("nao-ssp", "nao-dsp", "nao-cycle")
CHANGE, SAME = 0.05, 1e-6  # relative
COLD_PROBLEMS = (*PROBLEMS, "stairs-plan", "humanoid-ssp")
COLD_STEPS, COLD_TIME_S = 300, 60.0  # limits of each start
COLD_SAME = 1e-4  # relative
COMPARED = 100  # results that are compared with IPOPT, at most


def draw_change(problem: GaitProblem, rng: np.random.Generator) -> dict[str, float]:
    """Return every limit and weight, moved by up to ``CHANGE`` of its default."""
    moved = {q.name: q.default * (1.0 + CHANGE * rng.uniform(-1.0, 1.0)) for q in problem.own_parameters}
    return {q.name: float(np.clip(moved[q.name], q.minimum, q.maximum)) for q in problem.own_parameters}


def measure(name: str, changes: int, starts: int, seed: int, *, predict: bool) -> None:
    """Print one problem's times and shares."""
    problem = nlp_gait.load(name)
    solution = nlp_gait.solve(problem, starts=starts, solver=nlp_gait.IpoptSettings(compiled=True), workers=1)
    plan = nlp_gait.make_replanner(problem, near=solution, predict=predict)
    near = min(solution.starts, key=lambda outcome: outcome.rank)
    rng = np.random.default_rng(seed)
    drawn = [draw_change(problem, rng) for _ in range(changes)]
    plan.solve(drawn[0])  # buffers and caches
    found: list[Replan] = []
    wall, used = np.zeros(changes), np.zeros(changes)
    for k, values in enumerate(drawn):
        started, began = time.perf_counter(), time.thread_time()
        found.append(plan.solve(values))
        wall[k], used[k] = time.perf_counter() - started, time.thread_time() - began
    settings = replace(SHARP, compiled=True).prepare(problem)
    same, followed, compared = 0, 0, 0
    for values, result in list(zip(drawn, found, strict=True))[:COMPARED]:
        moved = problem.with_values(**values)
        own = settings.run_from(moved, replace(near, guess=result.guess, x=result.x))
        warm = settings.run_from(moved, near)
        if own is None or warm is None or not (own.converged and warm.converged):
            continue
        compared += 1
        cost = problem.objective.sign * result.objective
        good = result.feasible and result.converged
        same += good and abs(cost - own.cost) <= SAME * abs(own.cost)
        followed += good and cost - warm.cost <= SAME * abs(warm.cost)
    by_steps = sum(result.solver == "sqp" and result.converged for result in found)
    violated = [
        plan_violation(problem, values, result) for values, result in zip(drawn[:COMPARED], found, strict=False)
    ]
    print(
        f"{name}: wall median {1e3 * np.median(wall):.2f}, 99th percentile {1e3 * np.percentile(wall, 99):.2f} ms; processor "
        f"{1e3 * np.median(used):.2f}, {1e3 * np.percentile(used, 99):.2f} ms; steps median "
        f"{np.median([result.iterations for result in found]):g}; {by_steps} of {changes} without IPOPT; same optimum {same}, "
        f"not worse than IPOPT warm {followed} of {compared}; feasible for the exact functions "
        f"{sum(v <= FEASIBILITY_TOLERANCE for v in violated)} of {len(violated)}",
        flush=True,
    )


def measure_cold(name: str, count: int) -> None:
    """Print how often, how soon and how well steps from random starts converge, next to IPOPT."""
    problem = nlp_gait.load(name)
    settings = nlp_gait.IpoptSettings(compiled=True).prepare(problem)
    rng = np.random.default_rng(1)
    starts = [problem.start_point(rng) for _ in range(count)]
    outcomes, used = zip(*(time_call(partial(settings.run, problem, x)) for x in starts), strict=True)
    near = min(outcomes, key=lambda outcome: outcome.rank)
    if near.guess is None or not near.converged:
        print(f"{name}: IPOPT did not converge from any of {count} starts", flush=True)
        return
    unknown = replace(near, guess=replace(near.guess, rows=np.zeros_like(near.guess.rows)))
    results: list[Outcome | Replan] = list(outcomes)
    for x in starts:
        plan = Replanner(problem, unknown)
        solve = partial(plan.solve, x0=x, iterations=COLD_STEPS, time_limit_s=COLD_TIME_S, judge=True)
        result, taken = time_call(solve)
        results, used = [*results, result], (*used, taken)
    costs = [
        problem.objective.sign * each.objective if each.converged and each.feasible else np.inf for each in results
    ]
    for solver, part in (("IPOPT", slice(count)), ("SQP", slice(count, None))):
        own, times = np.array(costs[part]), np.array(used[part])
        best = np.sum(own - min(costs) <= COLD_SAME * abs(min(costs)))
        print(
            f"{name}, {solver}: {np.isfinite(own).sum()} of {count} converge, {best} to the best optimum; processor median "
            f"{1e3 * np.median(times):.0f} ms, in all {times.sum():.2f} s",
            flush=True,
        )


def measure_c(names: list[str], changes: int, starts: int, seed: int) -> None:
    """Print the table of C beside Python, and the example at 500 Hz."""
    print(onboard_c.HEADER, flush=True)
    for name in names or onboard_c.PROBLEMS:
        problem, rng = nlp_gait.load(name), np.random.default_rng(seed)
        solution = nlp_gait.solve(problem, starts=starts, solver=nlp_gait.IpoptSettings(compiled=True), workers=1)
        onboard_c.compare(problem, solution, [draw_change(problem, rng) for _ in range(changes)])
    for name in onboard_c.RECORDED:
        if not names or name in names:
            onboard_c.run_example(name, starts)


def time_call(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return a call's result and its time of processor [s]."""
    began = time.thread_time()
    result = call()
    return result, time.thread_time() - began


def plan_violation(problem: GaitProblem, values: dict[str, float], result: Replan) -> float:
    """Return the exact violation of a result."""
    return build_exact_model(problem).at(result.x, problem.with_values(**values).p).violation


def main() -> None:
    """Measure all problems."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.onboard", description=__doc__)
    parser.add_argument("problems", nargs="*")
    parser.add_argument("--changes", type=int, default=1000)
    parser.add_argument("--starts", type=int, default=5, help="of IPOPT for the first optimum")
    parser.add_argument("--cold", type=int, default=0, metavar="N", help="random starts of the comparison with IPOPT")
    parser.add_argument("--c", action="store_true", help="compare the planner in C with Python's")
    parser.add_argument("--predict", action="store_true", help="start from points predicted by sensitivities")
    parser.add_argument("--seed", type=int, default=1, help="of the changes")
    arguments = parser.parse_args()
    if arguments.c:
        measure_c(arguments.problems, arguments.changes, arguments.starts, arguments.seed)
        return
    for name in arguments.problems or (COLD_PROBLEMS if arguments.cold else PROBLEMS):
        if arguments.cold:
            measure_cold(name, arguments.cold)
        else:
            measure(name, arguments.changes, arguments.starts, arguments.seed, predict=arguments.predict)


if __name__ == "__main__":
    main()
