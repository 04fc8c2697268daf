"""Boxes that contain known feasible points are never lost: ``python -m benchmarks.guarantees.boxes [COUNT]``."""

from __future__ import annotations

import sys

import numpy as np

import nlp_gait
from tests.proofs.soundness import best_x, count_lost_boxes

COUNT = 10_000
SEED = 2


def main() -> None:
    """Check the problems with shipped proofs."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    rng = np.random.default_rng(SEED)
    for name in ("walk12", "nao-dsp", "nao-ssp"):
        lost = count_lost_boxes(nlp_gait.load(name), best_x(name), count, rng)
        print(f"{name}: {count:,} boxes that contain a known feasible point, {lost} lost", flush=True)


if __name__ == "__main__":
    main()
