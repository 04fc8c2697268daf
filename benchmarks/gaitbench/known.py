"""Best known points of GaitBench, the evidence for them, and probe values: ``python -m benchmarks.gaitbench.known``.

Finished instances are kept in ``nlp_gait/gaitbench/known.json``; a call goes on with those that are missing. A better point
than the one there may replace it, with ``--again``; probe values never change once they are published.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

import metaheuristics
import nlp_gait
from compare.questions.certainty.branch_and_bound import certify
from metaheuristics.adapters.cma import CmaEs
from nlp_gait import gaitbench
from nlp_gait.files import write_json
from nlp_gait.gaitbench.instance import Instance
from nlp_gait.gaitbench.known import Evidence, Known, Probe, known
from nlp_gait.problem import Array

FILE = Path(nlp_gait.__file__).parent / "gaitbench" / "known.json"
CATALOGUE = Path(nlp_gait.__file__).parents[1] / "docs" / "gaitbench.json"
SAME = 1e-6  # relative difference of two ends of IPOPT that count as one
# Starts of IPOPT by the greatest number of variables for which they are made; more variables take longer.
STARTS = ((12, 8), (22, 4), (300, 2))
CMA_RUNS, CMA_EVALUATIONS, CMA_MOST_VARIABLES = 1, 10_000, 12
SHARES, TIMED = 100_000, 20_000
# Slack that the best known point keeps to every row, in units of its scale: no machine's rounding makes it infeasible.
SLACK = 1e-10
PROOF_TOLERANCE = 1e-3


class NothingFound(Exception):
    """There is no point that could be called best known."""


def main() -> None:
    """Make what is missing."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gaitbench.known", description=__doc__.splitlines()[0])
    parser.add_argument("--subset", choices=("small", "full"), default="full")
    parser.add_argument("--instance", action="append", help="only this one; repeatable")
    parser.add_argument("--again", action="store_true", help="also those that are there")
    parser.add_argument("--prove-s", type=float, default=0.0, help="time for a proof where one can be had; 0 for none")
    arguments = parser.parse_args()
    for id in arguments.instance or gaitbench.names(arguments.subset):
        kept = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        if id in kept and not arguments.again:
            continue
        started = time.perf_counter()
        try:
            kept[id] = asdict(known_of(id, arguments.prove_s))
        except NothingFound as error:
            print(f"{id}: {error}", flush=True)
            continue
        write_json(FILE, {name: kept[name] for name in gaitbench.names() if name in kept})
        evidence = Evidence(**kept[id]["evidence"])
        print(f"{id}: {kept[id]['best_known']:.10g}, {evidence} ({time.perf_counter() - started:.0f} s)", flush=True)
    if set(known()) >= set(gaitbench.names()):
        write_json(CATALOGUE, gaitbench.catalogue())


def known_of(id: str, prove_s: float) -> Known:
    """Everything that is known of an instance, found now."""
    instance = gaitbench.load(id)
    problem, n = instance.gait_problem, len(instance.names)
    starts = next(count for most, count in STARTS if n <= most)
    solution = nlp_gait.solve(problem, starts=starts, seed=0)
    ends = [outcome for outcome in solution.starts if outcome.success]
    if not ends:
        raise NothingFound("no start of IPOPT converged to a feasible point")
    ends.sort(key=lambda outcome: outcome.cost)
    best = strictly_feasible(instance, np.array(ends[0].x))
    best_known = float(instance(best[None])[0][0])
    searched = long_search(instance) if n <= CMA_MOST_VARIABLES else None
    if searched is not None and searched[0] < best_known:  # CMA-ES is better: its point, refined by IPOPT
        refined = nlp_gait.solve(problem, starts=1, x0=searched[1])
        for x in (searched[1], strictly_feasible(instance, np.array(list(refined.x.values())))):
            f, violation = instance(x[None])
            if violation[0] == 0.0 and f[0] < best_known:
                best, best_known = x, float(f[0])
    agreeing = sum(relative(outcome.cost, best_known) <= SAME for outcome in ends)
    evidence = Evidence(
        starts=starts,
        agreeing=agreeing,
        cma_runs=0 if searched is None else CMA_RUNS,
        cma_evaluations=0 if searched is None else CMA_EVALUATIONS,
        cma_gap=None if searched is None or not math.isfinite(searched[0]) else relative(searched[0], best_known),
        proven_gap=proof(instance, best, prove_s),
    )
    rng = np.random.default_rng(0)
    X = rng.uniform(instance.lower, instance.upper, (SHARES, n))
    feasible = float(np.mean(instance(X)[1] == 0.0))
    return Known(
        best_known=best_known,
        best_x=tuple(best.tolist()),
        evidence=evidence,
        feasible_share=feasible,
        evaluation_us=evaluation_us(instance, X[:TIMED]),
        probes=probes(instance, best),
    )


def relative(cost: float, reference: float) -> float:
    """Distance of a cost from a reference, in units of the reference."""
    return (cost - reference) / (abs(reference) or 1.0)


def long_search(instance: Instance) -> tuple[float, Array]:
    """Best feasible objective of several long runs of CMA-ES, infinite if none ends feasible, and its point."""
    results = [
        metaheuristics.minimize(instance, CmaEs(), evaluations=CMA_EVALUATIONS, seed=1000 + run)
        for run in range(CMA_RUNS)
    ]
    best = min(results, key=lambda result: (result.violation, result.objective))
    return (best.objective if best.feasible else math.inf), np.array(best.x)


def proof(instance: Instance, best: Array, limit_s: float) -> float | None:
    """How much better than the best known a feasible point may be at most, by branch and bound; None without a bound."""
    if len(instance.names) > 4 or not limit_s:
        return None
    certificate = certify(instance.gait_problem, best, tolerance=PROOF_TOLERANCE, time_limit_s=limit_s)
    return certificate.gap if math.isfinite(certificate.bound) else None


def strictly_feasible(instance: Instance, x: Array) -> Array:
    """The best point near x that keeps a slack to every row, by linear programs of shrinking size.

    IPOPT may leave a row violated by some 1e-8; what is shipped as best known has a violation of exactly zero everywhere.
    """
    from scipy.optimize import linprog

    width = instance.upper - instance.lower
    x = np.clip(x, instance.lower, instance.upper)
    found: list[tuple[float, Array]] = []
    for radius in (1e-4, 1e-5, 1e-5, 1e-6, 1e-6, 1e-7, 1e-7, 1e-8, 1e-8):
        G = instance.rows(x[None])[0]
        if G.max() <= -SLACK / 2:
            found.append((float(instance(x[None])[0][0]), x))
        J = instance.jacobian(x) * width
        near = np.abs(J).sum(axis=1) * radius + G > -SLACK
        low, high = (instance.lower - x) / width / radius, (instance.upper - x) / width / radius
        step = linprog(
            instance.gradient(x) * width,
            A_ub=J[near],
            b_ub=-(G[near] + SLACK) / radius,
            bounds=list(zip(np.maximum(low, -1.0), np.minimum(high, 1.0), strict=True)),
        )
        if step.x is not None:
            x = np.clip(x + radius * width * step.x, instance.lower, instance.upper)
    if instance.rows(x[None]).max() <= -SLACK / 2:
        found.append((float(instance(x[None])[0][0]), x))
    if not found:
        raise NothingFound("no strictly feasible point near the end of IPOPT")
    return min(found, key=lambda item: item[0])[1]


def evaluation_us(instance: Instance, X: Array) -> float:
    """Least processor time of an evaluation in a batch, over some rounds [us]."""
    rounds = []
    for _ in range(5):
        before = time.process_time()
        instance(X)
        rounds.append((time.process_time() - before) / len(X))
    return round(1e6 * min(rounds), 2)


def probes(instance: Instance, best: Array) -> tuple[Probe, ...]:
    """Values at random points, on the way from them to the best one, and there."""
    rng = np.random.default_rng(20260101)
    draws = rng.uniform(instance.lower, instance.upper, (4, len(best)))
    X = np.concatenate([draws[:2], best + np.array([[0.3], [0.02]]) * (draws[2:] - best), best[None]])
    f, violation = instance(X)
    G = instance.rows(X)
    weights = 1.0 + np.arange(G.shape[1]) % 7
    return tuple(
        Probe(x=tuple(x.tolist()), objective=float(fi), violation=float(vi), rows=float(ri))
        for x, fi, vi, ri in zip(X, f, violation, G @ weights, strict=True)
    )


if __name__ == "__main__":
    main()
