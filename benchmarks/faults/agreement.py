"""How far compiled and interpreted values are apart: every searchable problem, every lane count that this CPU has.

    python -m benchmarks.faults.agreement [--candidates 4000] [--problems nao-ssp,walk12]

Half of the candidates lie within the bounds, half up to a range's width outside. Differences of the objective are relative;
those of the violation are absolute, in units of the rows' scales, or relative if it is above 1.
"""

from __future__ import annotations

import argparse

import numpy as np

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import LANE_COUNTS, compile_objective
from nlp_gait.backends.kernel.compiler import native_lanes
from nlp_gait.formulation import Array, GaitProblem

BLOCK = 100
TABLE = "{:<14}{:>6}{:>12}{:>14}{:>14}{:>18}{:>18}"


def candidates(problem: GaitProblem, count: int) -> Array:
    """Points (count, n)."""
    rng = np.random.default_rng(0)
    width = problem.upper - problem.lower
    inside = rng.uniform(problem.lower, problem.upper, (count // 2, len(width)))
    outside = rng.uniform(problem.lower - width, problem.upper + width, (count - count // 2, len(width)))
    return np.concatenate([inside, outside])


def interpreted(problem: GaitProblem, X: Array) -> tuple[Array, Array]:
    """Cost and violation by CasADi's virtual machine."""
    exact = build_exact_model(problem).function.map(BLOCK)
    p = np.repeat(problem.p[:, None], BLOCK, axis=1)
    parts = [exact(X[i : i + BLOCK].T, p)[:2] for i in range(0, len(X), BLOCK)]
    cost, violation = (np.concatenate([np.array(part[k]).ravel() for part in parts]) for k in (0, 1))
    return cost, violation


def main() -> None:
    """Print the largest differences and how many points agree bit for bit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--candidates", type=int, default=4000)
    parser.add_argument("--problems", default=",".join(nlp_gait.list_problems()))
    arguments = parser.parse_args()
    print(TABLE.format("problem", "lanes", "bit-equal", "objective", "violation", "beyond 1e-9", "order changed"))
    for name in arguments.problems.split(","):
        problem = nlp_gait.load(name)
        if not problem.searchable:
            continue
        X = candidates(problem, arguments.candidates // BLOCK * BLOCK)
        cost, violation = interpreted(problem, X)
        for lanes in (count for count in LANE_COUNTS if count <= native_lanes()):
            f, total = compile_objective(problem, require_compiler=True, lanes=lanes, threads=1)(X)
            apart = np.abs(f - cost) / np.maximum(np.abs(cost), np.finfo(float).tiny)
            violated = np.abs(total - violation) / np.maximum(np.abs(violation), 1.0)
            same = np.mean((f == cost) & (total == violation))
            ranks = np.count_nonzero(np.lexsort((f, total)) != np.lexsort((cost, violation)))
            beyond = np.count_nonzero(np.maximum(apart, violated) > 1e-9)
            row = (name, lanes, f"{same:.1%}", f"{apart.max():.1e}", f"{violated.max():.1e}", beyond, ranks)
            print(TABLE.format(*row), flush=True)


if __name__ == "__main__":
    main()
