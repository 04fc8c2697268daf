"""The best known point of an ``Instance``, strictly feasible, by IPOPT from random starts."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import hash_json, identify_problem, make_key
from nlp_gait.backends.kernel.library_cache import find_cache_folder
from nlp_gait.backends.solve import solve
from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder, replace_nan, write_json
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.facts import Evidence, Facts, find_shipped_facts
from nlp_gait.gaitbench.generated import STARTS, is_generated, parse_id

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance

SAME = 1e-6  # relative difference of two results of IPOPT that count as equal
# Slack of the best known point in every row, in units of its scale: no machine's rounding makes it infeasible.
SLACK = 1e-10
MOST_ROUNDS = 4  # of the starts, until one of them converges


def find_facts(instance: Instance) -> Facts:
    """Return the facts about an instance: shipped ones, or those of this call or of an earlier one on this machine.

    Raises InputError if no start of IPOPT converged, so that the instance has no best known point.
    """
    if (shipped := find_shipped_facts(instance.id)) is not None:
        return shipped
    digest = hash_json(make_key(identify_problem(instance.gait_problem)))
    path = find_cache_folder() / "gaitbench" / f"{instance.id.replace(':', '-')}-{digest[:16]}.json"
    try:
        return read_dataclass(Facts, path, "stored best known point", error=InputError)
    except InputError:
        facts = compute_facts(instance, parse_id(instance.id)[0].starts if is_generated(instance.id) else STARTS)
    make_writable_folder(path.parent)
    write_json(path, replace_nan(asdict(facts)))
    return facts


def compute_facts(instance: Instance, starts: int) -> Facts:
    """Return the best point of IPOPT from random starts and its evidence; raises InputError if no start converges."""
    problem = instance.gait_problem
    for seed in range(MOST_ROUNDS):
        ends = [outcome for outcome in solve(problem, starts=starts, seed=seed, workers=1).starts if outcome.converged]
        for end in sorted(ends, key=lambda outcome: outcome.cost):
            best = make_strictly_feasible(instance, np.array(end.x))
            if best is None:
                continue
            best_known = evaluate_interpreted(instance, best)[0]
            costs = [outcome.cost for outcome in ends]
            return Facts(
                best_known=best_known,
                best_x=tuple(best.tolist()),
                evidence=Evidence(
                    starts=starts * (seed + 1),
                    agreeing=sum(abs(c - best_known) <= SAME * abs(best_known) for c in costs),
                ),
            )
    raise InputError(
        f"{instance.id}: none of {starts * MOST_ROUNDS} starts of IPOPT converged to a feasible point; choose another seed"
    )


def evaluate_interpreted(instance: Instance, x: Array) -> tuple[float, Array]:
    """Return cost and rows (m,) at x (n,) without compiling anything."""
    values = build_exact_model(instance.gait_problem).at(x, instance.gait_problem.p)
    return values.cost, instance.sides(values.g[None])[0]


def make_strictly_feasible(instance: Instance, x: Array) -> Array | None:
    """Return the nearest point with a slack in every row, by linear programs with the smallest possible step, or None.

    IPOPT may leave a row violated by about 1e-8; the best known point has a violation of exactly zero. The programs ignore the
    objective: where it is the largest of several functions, its gradient is that of one of them.
    """
    from scipy.optimize import linprog

    width = instance.upper - instance.lower
    first = np.clip(x, instance.lower, instance.upper)
    n, ends = len(width), list[tuple[float, Array]]()
    for radius in (1e-8, 1e-7, 1e-6, 1e-5, 1e-4):
        x = first
        for _ in range(4):
            cost, G = evaluate_interpreted(instance, x)
            if G.max() <= -SLACK / 2:
                ends.append((cost, x))
                break
            J = instance.jacobian(x) * width
            near = np.abs(J).sum(axis=1) * radius + G > -SLACK
            low, high = (instance.lower - x) / width / radius, (instance.upper - x) / width / radius
            bounds = [*zip(np.maximum(low, -1.0), np.minimum(high, 1.0), strict=True), (0.0, 1.0)]
            least = np.hstack([np.vstack([np.eye(n), -np.eye(n)]), -np.ones((2 * n, 1))])  # |step| <= its largest part
            step = linprog(
                np.eye(n + 1)[-1],
                A_ub=np.vstack([np.hstack([J[near], np.zeros((int(near.sum()), 1))]), least]),
                b_ub=np.concatenate([-(G[near] + SLACK) / radius, np.zeros(2 * n)]),
                bounds=bounds,
            )
            if step.x is None:
                break
            x = np.clip(x + radius * width * step.x[:n], instance.lower, instance.upper)
    return min(ends, key=lambda item: item[0])[1] if ends else None
