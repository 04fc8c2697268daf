"""Boxes that hold known feasible points are never lost: ``python -m benchmarks.guarantees.boxes [COUNT]``."""

from __future__ import annotations

import sys

import numpy as np

import nlp_gait
from benchmarks.guarantees.between_samples import feasible_gaits
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.proofs.bounds import bounds_of

COUNT = 10_000
SEED = 2
INSTANCES = {"walk12": "walk12-w015", "nao-dsp": "dsp-v5", "nao-ssp": "ssp-v5"}
# Points of which each lies in many boxes.
POINTS = 100


def lost(problem: GaitProblem, best: Array, count: int, rng: np.random.Generator) -> int:
    """How many random boxes around feasible points are dropped or cut so that their point is gone, or get too high a bound."""
    points = np.array(feasible_gaits(problem, best, min(count, POINTS), rng))
    costs = np.array([build_exact_model(problem).at(x, problem.p).cost for x in points])
    bounds = bounds_of(problem)
    low, high = bounds.whole[0].T
    which = rng.integers(0, len(points), count)
    X = bounds.place(points)[which]
    half = (high - low) / 2 * 10.0 ** rng.uniform(-5, 0, (count, 1))
    shift = rng.uniform(-1.0, 1.0, X.shape)
    lower, upper = np.maximum(low, X + half * (shift - 1)), np.minimum(high, X + half * (shift + 1))
    boxes = np.stack([np.minimum(lower, X), np.maximum(upper, X)], axis=-1)
    found = bounds.assess(boxes, float(costs.max()) + 1e-9)
    X, costs = X[found.origin], costs[which][found.origin]
    inside = np.all((found.boxes[..., 0] <= X) & (X <= found.boxes[..., 1]), axis=1)
    return count - int(np.count_nonzero(inside & (found.lowest <= costs * (1.0 + 1e-12))))


def main() -> None:
    """Check all problems."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    rng = np.random.default_rng(SEED)
    for name, instance in INSTANCES.items():
        gone = lost(nlp_gait.load(name), np.array(load_facts()[instance].best_x), count, rng)
        print(f"{name}: {count:,} boxes that hold a known feasible point, {gone} lost", flush=True)


if __name__ == "__main__":
    main()
