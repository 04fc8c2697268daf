"""Best known points of GaitBench, the evidence for them, and probe values: ``python -m benchmarks.gaitbench.facts``.

The points are found with IPOPT from random starts and with CMA-ES.
Finished instances are stored in ``nlp_gait/gaitbench/facts.json``; rerun the command to continue with the missing ones. With
``--again``, a better point may replace the stored one; probe values never change once they are published. The bounds that the
shipped certificates prove are always included.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import metaheuristics
import nlp_gait
from metaheuristics.adapters.cma import CmaEs
from nlp_gait import gaitbench
from nlp_gait.decoding import decode
from nlp_gait.files import write_json
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.facts import Evidence, Facts, Probe
from nlp_gait.gaitbench.instance import SAME, Instance, evaluate_interpreted, make_strictly_feasible
from nlp_gait.proofs.certificate import load_certificates

FILE = Path(nlp_gait.__file__).parent / "gaitbench" / "facts.json"


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Effort of the search for the best point of an instance.

    Attributes:
        starts: of IPOPT, by the greatest number of variables that they are for.
        cma_runs: long runs of CMA-ES.
        cma_evaluations: of each.
        cma_most_variables: more variables get no run of CMA-ES.
    """

    starts: tuple[tuple[int, int], ...]
    cma_runs: int
    cma_evaluations: int
    cma_most_variables: int


THOROUGH = Effort(
    starts=((12, 40), (22, 20), (60, 8), (300, 5)), cma_runs=2, cma_evaluations=30_000, cma_most_variables=22
)
QUICK = Effort(starts=((12, 6), (22, 2), (300, 1)), cma_runs=1, cma_evaluations=5_000, cma_most_variables=12)
SHARES, TIMED = 100_000, 20_000


class NothingFound(Exception):
    """No feasible point was found."""


def main() -> None:
    """Compute the missing facts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gaitbench.facts", description=__doc__.splitlines()[0])
    parser.add_argument("--subset", choices=("small", "full"), default="full")
    parser.add_argument("--instance", action="append", help="only this one; repeatable")
    parser.add_argument("--again", action="store_true", help="also instances with stored facts; their probes stay")
    parser.add_argument("--quick", action="store_true", help="a first pass: few starts, one short run of CMA-ES")
    arguments = parser.parse_args()
    for id in arguments.instance or gaitbench.list_instances(arguments.subset):
        kept = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        published = decode(Facts, kept[id], id) if id in kept else None
        started = time.perf_counter()
        try:
            if published is None or arguments.again:
                found = find_facts(id, QUICK if arguments.quick else THOROUGH, published)
            else:
                gap = find_proven_gap(id, published.best_known)
                if gap in (None, published.evidence.proven_gap):
                    continue
                found = replace(published, evidence=replace(published.evidence, proven_gap=gap))
        except NothingFound as error:
            print(f"{id}: {error}", flush=True)
            continue
        kept[id] = asdict(found)
        write_json(FILE, {name: kept[name] for name in gaitbench.list_instances() if name in kept})
        evidence = Evidence(**kept[id]["evidence"])
        print(f"{id}: {kept[id]['best_known']:.10g}, {evidence} ({time.perf_counter() - started:.0f} s)", flush=True)


def find_facts(id: str, effort: Effort, published: Facts | None) -> Facts:
    """Compute the facts about an instance; a better published point is kept, and so are the probes."""
    instance = gaitbench.load(id)
    problem, n = instance.gait_problem, len(instance.names)
    starts = next(count for most, count in effort.starts if n <= most)
    solution = nlp_gait.solve(problem, starts=starts, seed=0)
    ends = [outcome for outcome in solution.starts if outcome.converged]
    if not ends:
        raise NothingFound("no start of IPOPT converged to a feasible point")
    ends.sort(key=lambda outcome: outcome.cost)
    best = make_strictly_feasible(instance, np.array(ends[0].x))
    if best is None:
        raise NothingFound("no strictly feasible point near IPOPT's result")
    best_known = float(instance(best[None])[0][0])
    searched = long_search(instance, effort) if n <= effort.cma_most_variables else None
    others = [] if searched is None else [searched]
    for objective, point in others:
        if objective < best_known:
            for x in near(instance, point):
                f, violation = instance(x[None])
                if violation[0] == 0.0 and f[0] < best_known:
                    best, best_known = x, float(f[0])
    if published is not None and published.best_known < best_known:
        best, best_known = np.array(published.best_x), published.best_known
    proven = find_proven_gap(id, best_known)
    if proven is None and published is not None:
        proven = published.evidence.proven_gap
    agreeing = sum(relative(outcome.cost, best_known) <= SAME for outcome in ends)
    evidence = Evidence(
        starts=starts,
        agreeing=agreeing,
        cma_runs=0 if searched is None else effort.cma_runs,
        cma_evaluations=0 if searched is None else effort.cma_evaluations,
        cma_gap=None if searched is None or not math.isfinite(searched[0]) else relative(searched[0], best_known),
        proven_gap=proven,
    )
    rng = np.random.default_rng(0)
    X = rng.uniform(instance.lower, instance.upper, (SHARES, n))
    feasible = float(np.mean(instance(X)[1] == 0.0))
    return Facts(
        best_known=best_known,
        best_x=tuple(best.tolist()),
        evidence=evidence,
        feasible_share=feasible,
        evaluation_us=evaluation_us(instance, X[:TIMED]),
        probes=make_probes(instance, best) if published is None else published.probes,
    )


def make_probes(instance: Instance, best: Array) -> tuple[Probe, ...]:
    """Return values at random points, between them and the best one, and at the best one."""
    rng = np.random.default_rng(20260101)
    draws = rng.uniform(instance.lower, instance.upper, (4, len(best)))
    probes = []
    for x in np.concatenate([draws[:2], best + np.array([[0.3], [0.02]]) * (draws[2:] - best), best[None]]):
        f, G = evaluate_interpreted(instance, x)
        rows, violation = float(G @ (1.0 + np.arange(len(G)) % 7)), float(np.maximum(G, 0.0).sum())
        probes.append(Probe(x=tuple(x.tolist()), objective=f, violation=violation, rows=rows))
    return tuple(probes)


def relative(cost: float, reference: float) -> float:
    """Return the difference of a cost and a reference, in units of the reference."""
    return (cost - reference) / (abs(reference) or 1.0)


def long_search(instance: Instance, effort: Effort) -> tuple[float, Array]:
    """Return the best feasible objective of several long runs of CMA-ES, infinite if there is none, and its point."""
    results = [
        metaheuristics.minimize(instance, CmaEs(), evaluations=effort.cma_evaluations, seed=1000 + run)
        for run in range(effort.cma_runs)
    ]
    best = min(results, key=lambda result: (result.violation, result.objective))
    return (best.objective if best.feasible else math.inf), np.array(best.x)


def near(instance: Instance, point: Array) -> Iterator[Array]:
    """Yield a search's point, and strictly feasible points near it and near IPOPT's result from there."""
    yield point
    refined = nlp_gait.solve(instance.gait_problem, starts=1, x0=np.clip(point, instance.lower, instance.upper))
    for x in (point, np.array(list(refined.x.values()))):
        if (feasible := make_strictly_feasible(instance, x)) is not None:
            yield feasible


def find_proven_gap(id: str, best_known: float) -> float | None:
    """Return how much better than the best known any feasible point can be, by the shipped certificates; None without one."""
    file = load_certificates().get(id)
    return None if file is None else (best_known - file.certificate.bound) / abs(best_known)


def evaluation_us(instance: Instance, X: Array) -> float:
    """Return the least processor time of an evaluation in a batch, over some rounds [us]."""
    rounds = []
    for _ in range(5):
        before = time.process_time()
        instance(X)
        rounds.append((time.process_time() - before) / len(X))
    return round(1e6 * min(rounds), 2)


if __name__ == "__main__":
    main()
