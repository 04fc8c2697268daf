"""Largest error of f of the 12-joint walk by its quadrature: ``python -m benchmarks.guarantees.quadrature``.

The integrand of Q is smooth over a step, but spikes where a leg is nearly straight. Differential evolution looks for the gait
with the largest error in f at lambda = 1, over all gaits whose bending height is the least with which both legs reach. The
reference is Gauss's rule on 440 nodes.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from casadi import DM, SX
from scipy.optimize import differential_evolution

import nlp_gait
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import compute_knee_cosines, compute_legs, compute_zmp, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_problem import make_rule
from nlp_gait.symbolic.nonsmooth import Exact

PROBLEM = nlp_gait.load("walk12")
ROBOT = load_point_mass_biped()
F1MAX, MARGIN = PROBLEM.value("f1max"), PROBLEM.value("reach_margin_rad")
HALVINGS, SEEDS, GENERATIONS = 26, 3, 40
RULES = {"gauss, 160 nodes": ("gauss", 20), "simpson, 20 intervals": ("simpson", 20), "simpson, 400": ("simpson", 400)}


def make_f1(nodes: DM, weights: DM) -> ca.Function:
    """Return the function of x (4,) to f1 by a rule [1/(m^2 s)]."""
    x, phase, margin = SX.sym("x", 4), SX.sym("phase"), SX(1 - math.cos(MARGIN))
    zmp = compute_zmp(*compute_legs(x, phase, SX(1), SX(0), margin, ROBOT, Exact()), ROBOT, "exact")
    sample = ca.Function("zmp", [x, phase], [ca.cse(ca.sumsqr(zmp))])
    X, n = ca.MX.sym("x", 4), nodes.shape[1]
    return ca.Function("f1", [X], [1 / (sample.map(n)(ca.repmat(X, 1, n), nodes) @ weights)])


def make_reach() -> ca.Function:
    """Return the function of x (4,) to the greatest cosine of a knee at the 11 instants of the reach."""
    x, phase = SX.sym("x", 4), SX.sym("phase")
    cosines = ca.Function("reach", [x, phase], [compute_knee_cosines(x, phase, ROBOT)])
    X, phases = ca.MX.sym("x", 4), DM(np.linspace(0.0, 1.0, 11)).T
    return ca.Function("reach", [X], [ca.mmax(cosines.map(11)(ca.repmat(X, 1, 11), phases))])


def map_rows(function: ca.Function, X: Array) -> Array:
    """Evaluate a function of (4,) at points (P, 4)."""
    values: Array = np.array(function.map(len(X))(X.T)).ravel()
    return values


def straighten(S: Array, reach: ca.Function) -> Array:
    """Return x (P, 4) of s, n and H (P, 3) with the least bending height with which both legs reach."""
    low, high = np.full(len(S), PROBLEM.lower[3]), np.full(len(S), PROBLEM.upper[3])
    limit = math.cos(MARGIN)
    free = map_rows(reach, np.c_[S, low]) <= limit
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        reached = map_rows(reach, np.c_[S, middle]) <= limit
        low, high = np.where(reached, low, middle), np.where(reached, middle, high)
    return np.column_stack([S, np.where(free, PROBLEM.lower[3], high)])


def main() -> None:
    """Print the largest error of each rule, for each seed, and where it is."""
    nodes, weights = np.polynomial.legendre.leggauss(44)
    reference = make_f1(DM(((np.arange(10)[:, None] + (nodes + 1) / 2) / 10).ravel()).T, DM(np.tile(weights / 20, 10)))
    reach, bounds = make_reach(), list(zip(PROBLEM.lower[:3], PROBLEM.upper[:3], strict=True))
    for name, (quadrature, intervals) in RULES.items():
        rule = make_f1(*make_rule(quadrature, intervals))  # type: ignore[arg-type]

        def cost(S: Array, rule: ca.Function = rule) -> Array:
            X = straighten(np.atleast_2d(S.T), reach)
            return -np.log10(np.abs(map_rows(rule, X) - map_rows(reference, X)) / F1MAX + 1e-16)

        settings = {"vectorized": True, "updating": "deferred", "popsize": 12, "maxiter": GENERATIONS, "polish": False}
        ends = [differential_evolution(cost, bounds, seed=seed, **settings) for seed in range(SEEDS)]
        worst = min(ends, key=lambda end: end.fun)
        x = straighten(worst.x[None, :], reach)[0]
        print(f"{name}: {', '.join(f'{10**-end.fun:.2g}' for end in ends)}; at {np.round(x, 4).tolist()}", flush=True)


if __name__ == "__main__":
    main()
