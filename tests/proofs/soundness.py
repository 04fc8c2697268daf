"""Random gaits and boxes against what is proven of them: no proof may contradict a feasible point or a fine grid of samples."""

from functools import cache

import numpy as np

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.facts import get_definition, load_facts
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.guarantee import guarantee

TOLERANCE = 1e-6
# Rounding errors of values on the grid, and the factor of the step in errors of its quadrature.
ROUNDING, QUADRATURE = 1e-9, 5.0
INSTANCES = {
    "nao-ssp": "ssp-v5",
    "nao-dsp": "dsp-v5",
    "walk12": "walk12-w015",
    "nao-cycle": "cycle-v5",
    "stairs-plan": "stairs-energy",
}
POINTS = 100  # feasible points at most, each of which lies in many boxes


def best_x(name: str) -> Array:
    """Return the best known point of a problem."""
    return np.array(load_facts()[INSTANCES[name]].best_x)


@cache
def load(name: str) -> GaitProblem:
    """Load a problem once for all tests, with the options of its instance."""
    return nlp_gait.load(name, **get_definition(INSTANCES[name]).options)


def narrow_around(problem: GaitProblem, x: Array, part: float) -> GaitProblem:
    """Return a problem with bounds that are this part of the ranges around a point, and nowhere wider."""
    half = part * (problem.upper - problem.lower) / 2
    named = (("lower", np.maximum(problem.lower, x - half)), ("upper", np.minimum(problem.upper, x + half)))
    return problem.with_values(
        **{f"{n}.{end}": float(v) for end, values in named for n, v in zip(problem.names, values, strict=True)}
    )


def feasible_gaits(problem: GaitProblem, best: Array, count: int, rng: np.random.Generator) -> list[Array]:
    """Return random points, between the best known one and anywhere in the box, that are feasible on the samples."""
    model, found = build_exact_model(problem), list[Array]()
    while len(found) < count:
        share = rng.uniform(0.0, 1.0) ** 2
        x = best + share * (rng.uniform(problem.lower, problem.upper) - best)
        if model.at(x, problem.p).violation <= TOLERANCE:
            found.append(x)
    return found


def count_lost_boxes(problem: GaitProblem, best: Array, count: int, rng: np.random.Generator) -> int:
    """Count the random boxes around feasible points that lose their point, or get a bound above its cost."""
    points = np.array(feasible_gaits(problem, best, min(count, POINTS), rng))
    costs = np.array([build_exact_model(problem).at(x, problem.p).cost for x in points])
    bounds = make_bounds(problem)
    low, high = bounds.root[0].T
    which = rng.integers(0, len(points), count)
    Z = bounds.to_z(points)[which]
    half = (high - low) / 2 * 10.0 ** rng.uniform(-5, 0, (count, 1))
    shift = rng.uniform(-1.0, 1.0, Z.shape)
    lower, upper = np.maximum(low, Z + half * (shift - 1)), np.minimum(high, Z + half * (shift + 1))
    boxes = np.stack([np.minimum(lower, Z), np.maximum(upper, Z)], axis=-1)
    found = bounds.prune(boxes, float(costs.max()) + 1e-9)
    Z, costs = Z[found.origin], costs[which][found.origin]
    inside = np.all((found.boxes[..., 0] <= Z) & (Z <= found.boxes[..., 1]), axis=1)
    return count - int(np.count_nonzero(inside & (found.lowest <= costs * (1.0 + 1e-12))))


def find_contradictions(problem: GaitProblem, gaits: list[Array], samples: int) -> tuple[list[str], int]:
    """Return contradictions of guarantees to a fine grid, in words, and the number of gaits that satisfy all limits."""
    factor = -(-(samples - 1) // problem.grid.parts)
    dense = problem.dense(factor)
    model = build_exact_model(dense)
    found, satisfied = list[str](), 0
    stems, places = np.unique([_without_sample(name) for name in model.row_names], return_inverse=True)
    order = np.argsort(places, kind="stable")
    begins = np.searchsorted(places[order], np.arange(len(stems)))
    for x in gaits:
        proven = guarantee(problem, x)
        values = model.at(x, dense.p)
        violation = np.maximum(values.lower - values.g, values.g - values.upper)
        by_row = dict(zip(stems.tolist(), np.maximum.reduceat(violation[order], begins).tolist(), strict=True))
        allowed = {v.row: np.inf if v.most is None else v.most for v in proven.violations}
        satisfied += proven.satisfied is True
        slack = QUADRATURE / (factor * problem.grid.parts)
        for name, value in by_row.items():
            most = max(allowed.get(name, 0.0), TOLERANCE)
            if name not in proven.sampled and value > most + (slack if name.endswith("_mean") else ROUNDING):
                found.append(f"{problem.name} {x.tolist()}: {name} by {value} on the grid, {most} proven")
        for name, (low, high) in proven.means.items():
            if not low - slack * abs(low) <= values.metrics[name] <= high + slack * abs(high):
                found.append(f"{problem.name} {x.tolist()}: {name} {values.metrics[name]} outside [{low}, {high}]")
    return found, satisfied


def _without_sample(row: str) -> str:
    """Return the name of a row without its sample, the last number of its label."""
    if not row.endswith("]"):
        return row
    stem, _, label = row[:-1].partition("[")
    rest = label.rpartition(",")[0]
    return f"{stem}[{rest}]" if rest else stem
