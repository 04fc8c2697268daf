"""Where the best points of generated instances are in their boxes, and what an instance costs.

``python -m benchmarks.gaitbench.positions --families ssp,dsp --seeds 0:12``
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.stats import kstest

from compare.bench.baseline import parse_seeds
from nlp_gait import gaitbench
from nlp_gait.errors import InputError

AT_BOUND, AT_CENTRE = 1e-3, 0.02


def main() -> None:
    """Print a line for each family and one for all."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.gaitbench.positions", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--families", default=",".join(gaitbench.list_families()))
    parser.add_argument("--seeds", default="0:12")
    arguments = parser.parse_args()
    everything: list[float] = []
    for family in arguments.families.split(","):
        before, found, missing, agreeing = time.process_time(), list[float](), 0, 0
        seeds = parse_seeds(arguments.seeds)
        for seed in seeds:
            instance = gaitbench.generate(family, seed)
            try:
                found += instance.best_x.tolist()
                agreeing += instance.evidence.agreeing > 1
            except InputError:
                missing += 1
        each = (time.process_time() - before) / len(seeds)
        print(
            f"{family}: {each:.2f} s each, {missing} without best point, {agreeing} with agreeing starts; {describe(found)}"
        )
        everything += found
    print(f"all: {describe(everything)}")


def describe(positions: list[float]) -> str:
    """Return the shares at bounds and at the centre, and the distance from a uniform distribution."""
    z = np.array(positions)
    bound, centre = np.mean(np.minimum(z, 1 - z) < AT_BOUND), np.mean(np.abs(z - 0.5) <= AT_CENTRE)
    test = kstest(z, "uniform")
    uniform = f"Kolmogorov-Smirnov {test.statistic:.3f}, p {test.pvalue:.2g}"
    return f"{100 * bound:.2f} % at a bound, {100 * centre:.2f} % at the centre, {uniform}"


if __name__ == "__main__":
    main()
