"""Guarantees between samples against a fine grid.

``python -m benchmarks.guarantees.between_samples [GAITS [SAMPLES [NAME ...]]]``.

Random feasible gaits of each problem: none that is proven to hold at all times may break a row on the grid, none that is proven
to fail may fail there by more than proven, and every time mean lies within its bounds.
"""

from __future__ import annotations

import sys
import time
from statistics import median

import numpy as np

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem, registry
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs.guarantee import guarantee

GAITS, SAMPLES = 100, 100_001
SEED = 19
TOLERANCE = 1e-6
# Of values computed in double precision on the grid, and of its quadrature, which errs with the square of the step.
ROUNDING, QUADRATURE = 1e-9, 5.0
INSTANCES = {
    "nao-ssp": "ssp-v5",
    "nao-dsp": "dsp-v5",
    "walk12": "walk12-w015",
    "nao-cycle": "cycle-v5",
    "stairs-plan": "stairs-energy",
}


def feasible_gaits(problem: GaitProblem, best: Array, count: int, rng: np.random.Generator) -> list[Array]:
    """Random points between the best known one and anywhere in the box that are feasible on the samples."""
    model, found = build_exact_model(problem), []
    while len(found) < count:
        share = rng.uniform(0.0, 1.0) ** 2
        x = best + share * (rng.uniform(problem.lower, problem.upper) - best)
        if model.at(x, problem.p).violation <= TOLERANCE:
            found.append(x)
    return found


def contradictions(problem: GaitProblem, gaits: list[Array], samples: int) -> tuple[list[str], list[float], int]:
    """What a grid says against the guarantees, CPU seconds of each guarantee, and how many hold."""
    factor = -(-(samples - 1) // problem.grid.parts)
    dense = problem.dense(factor)
    model = build_exact_model(dense)
    found, seconds, holding = [], [], 0
    stems, places = np.unique([row_of(name) for name in model.row_names], return_inverse=True)
    order = np.argsort(places, kind="stable")
    begins = np.searchsorted(places[order], np.arange(len(stems)))
    guarantee(problem, gaits[0])  # builds
    for x in gaits:
        begun = time.process_time()
        proven = guarantee(problem, x)
        seconds.append(time.process_time() - begun)
        values = model.at(x, dense.p)
        excess = np.maximum(values.lower - values.g, values.g - values.upper)
        by_row = dict(zip(stems.tolist(), np.maximum.reduceat(excess[order], begins).tolist(), strict=True))
        allowed = {b.row: np.inf if b.most is None else b.most for b in proven.breaches}
        holding += proven.holds is True
        slack = QUADRATURE / (factor * problem.grid.parts)
        for name, value in by_row.items():
            mean = name.endswith("_mean")
            most = max(allowed.get(name, 0.0), TOLERANCE)
            if name not in proven.sampled and value > most + (slack if mean else ROUNDING):
                found.append(f"{problem.name} {x.tolist()}: {name} by {value} on the grid, {most} proven")
        for name, (low, high) in proven.means.items():
            if not low - slack * abs(low) <= values.indexes[name] <= high + slack * abs(high):
                found.append(f"{problem.name} {x.tolist()}: {name} {values.indexes[name]} outside [{low}, {high}]")
    return found, seconds, holding


def row_of(name: str) -> str:
    """Name of a row without its sample: the last number of its label."""
    if not name.endswith("]"):
        return name
    stem, _, label = name[:-1].partition("[")
    rest = label.rpartition(",")[0]
    return f"{stem}[{rest}]" if rest else stem


def main() -> None:
    """Check all problems."""
    count, samples = (int(sys.argv[k + 1]) if len(sys.argv) > k + 1 else d for k, d in enumerate((GAITS, SAMPLES)))
    rng = np.random.default_rng(SEED)
    registry.LARGEST_COUNT = max(registry.LARGEST_COUNT, 2 * samples)  # a user's grid ends at 10,000 intervals
    for name in sys.argv[3:] or INSTANCES:
        instance = INSTANCES[name]
        problem = nlp_gait.load(name)
        best = np.array(load_facts()[instance].best_x)
        gaits = feasible_gaits(problem, best, count, rng)
        against, seconds, holding = contradictions(problem, gaits, samples)
        print(
            f"{name}: {len(gaits)} feasible gaits, {holding} proven at all times, {len(against)} contradicted by {samples:,} "
            f"samples; {1000 * median(seconds):.0f} ms of CPU in the median, {1000 * max(seconds):.0f} ms at most",
            flush=True,
        )
        for text in against[:5]:
            print(f"  {text}")


if __name__ == "__main__":
    main()
