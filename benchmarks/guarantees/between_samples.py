"""Guarantees between samples against a fine grid.

``python -m benchmarks.guarantees.between_samples [GAITS [SAMPLES [NAME ...]]]``.

Random feasible gaits of each problem: no gait that is proven to satisfy all limits may violate one on the grid, none may violate
one by more than proven, and every time mean lies within its bounds.
"""

from __future__ import annotations

import sys
from statistics import median

import numpy as np

import nlp_gait
from nlp_gait.formulation import registry
from tests.proofs.soundness import INSTANCES, best_x, feasible_gaits, find_contradictions

GAITS, SAMPLES = 100, 100_001
SEED = 19


def main() -> None:
    """Check all problems."""
    count, samples = (int(sys.argv[k + 1]) if len(sys.argv) > k + 1 else d for k, d in enumerate((GAITS, SAMPLES)))
    rng = np.random.default_rng(SEED)
    registry.LARGEST_COUNT = max(registry.LARGEST_COUNT, 2 * samples)  # a user's grid has 10,000 intervals at most
    for name in sys.argv[3:] or INSTANCES:
        problem = nlp_gait.load(name)
        gaits = feasible_gaits(problem, best_x(name), count, rng)
        found, seconds, satisfied = find_contradictions(problem, gaits, samples)
        print(
            f"{name}: {len(gaits)} feasible gaits, {satisfied} proven at all times, {len(found)} contradictions by {samples:,} "
            f"samples; {1000 * median(seconds):.0f} ms of CPU in the median, {1000 * max(seconds):.0f} ms at most",
            flush=True,
        )
        print(*found[:5], sep="\n  ", end="\n" * bool(found))


if __name__ == "__main__":
    main()
