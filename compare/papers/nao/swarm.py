"""The swarm as the code that the paper cites updates it: the best particle is known at once, not after a whole sweep."""

from __future__ import annotations

import math

import numpy as np

from compare.study.run import ProblemSpec
from metaheuristics.algorithms.particle_swarm import ParticleSwarm, move, reflect
from nlp_gait.backends.kernel.compiled import compile_objective


def run_asynchronous(spec: ProblemSpec, runs: int, evaluations: int) -> list[float]:
    """Return the objective at the end of each run by Deb's rules; infinite without a feasible point."""
    objective, settings = compile_objective(spec.load(), threads=1), ParticleSwarm()
    lower, upper = objective.lower, objective.upper
    ends = []
    for seed in range(runs):
        rng, inertia = np.random.default_rng(seed), settings.inertia
        X = rng.uniform(lower, upper, (settings.population, len(lower)))
        V, own, keys = np.zeros_like(X), X.copy(), [(math.inf, math.inf)] * len(X)
        leader, best = X[0], (math.inf, math.inf)
        for iteration in range(evaluations // len(X)):
            for k, x in enumerate(X):
                if iteration:
                    r1, r2 = rng.random((2, len(x)))
                    pulls = settings.cognitive * r1 * (own[k] - x), settings.social * r2 * (leader - x)
                    moved, v = move(x, V[k], *pulls, inertia, settings.velocity_limit * (upper - lower))
                    X[k], V[k] = reflect(moved, v, lower, upper)
                f, violation = objective(X[k : k + 1])
                key = float(violation[0]), float(f[0])
                if key < keys[k]:
                    keys[k], own[k] = key, X[k]
                if key < best:
                    best, leader = key, X[k].copy()
            inertia *= settings.inertia_damping if iteration else 1.0
        ends.append(best[1] if best[0] == 0.0 else math.inf)
    return ends
