"""Least-power forms against the judge: ``python -m benchmarks.guarantees.difference [COUNT [ID ...]]``.

At COUNT random points of the whole box at which the legs reach, the cost, every change of torque and both mean margins are
computed by the form and by the exact functions; the largest difference must be below what the proofs widen every bound by.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from benchmarks.guarantees.certificates import list_covered, make_problem
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.power_form import WIDENING
from nlp_gait.proofs.bounds import has_power_form

COUNT, BATCH, SEED = 2_000, 500, 3
CONFIDENCE = 1e-6  # probability that a larger share of the box differs by more


class Difference(NamedTuple):
    """Largest differences."""

    points: int
    cost: float  # relative
    torque: float  # of a change of torque [Nm]
    margin: float  # of a mean margin [m]


def compare(problem: GaitProblem, count: int, seed: int = SEED) -> Difference:
    """Compare a problem's least-power form with its exact functions.

    Raises:
        InputError: the problem has no such form, or another number of torque changes.
    """
    if problem.power_form is None:
        raise InputError(f"problem {problem.name!r} has no least-power form")
    form, model, rng = problem.power_form(problem), build_exact_model(problem), np.random.default_rng(seed)
    names = np.array([name.partition("[")[0] for name in model.row_names])
    limit = problem.parameter_values["torque_change_limit_Nm"]
    changes = form.rows.row[np.abs(form.rows.upper - limit) < 1e-3 * limit]
    if len(changes) != np.sum(names == "torque_change"):
        raise InputError(f"the form has {len(changes)} torque changes, the problem {np.sum(names == 'torque_change')}")
    worst, seen = np.zeros(3), 0
    while seen < count:
        X = rng.uniform(problem.lower, problem.upper, (BATCH, len(problem.names)))
        cost, _, g, lower, upper, indexes = (
            np.array(part).T for part in model.function.map(BATCH)(X.T, np.repeat(problem.p[:, None], BATCH, 1))
        )
        reach = (np.maximum(lower - g, g - upper)[:, names == "reach"] <= 0.0).all(axis=1)
        exact = dict(zip(model.index_names, indexes.T, strict=True))
        Z = form.to_z(X).T
        found = dict(
            zip(form.indexes.name_out(), (np.array(v)[0] for v in form.indexes.map(BATCH).call([Z])), strict=True)
        )
        torques = np.array(form.function.map(BATCH)(Z)).T[:, changes]
        # The rows have other orders, so that sorted ones are compared.
        torques, given = np.sort(torques, axis=1), np.sort(g[:, names == "torque_change"], axis=1)
        means = [np.abs(found[name] - exact[name]) for name in ("dbm_x_mean_m", "dbm_y_mean_m")]
        each = (np.abs(found["power_W"] / cost[:, 0] - 1.0), np.abs(torques - given).max(axis=1), np.max(means, axis=0))
        worst = np.maximum(worst, [part[reach].max(initial=0.0) for part in each])
        seen += int(reach.sum())
    return Difference(seen, *worst.tolist())


def main() -> None:
    """Compare all problems with a form."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    for name in sys.argv[2:] or [id for id in list_covered() if has_power_form(make_problem(id)[0])]:
        found = compare(make_problem(name)[0], count)
        share = 1.0 - CONFIDENCE ** (1.0 / found.points)
        print(
            f"{name}: {found.points:,} points; largest difference of the cost {found.cost:.1e} (relative), of a change of torque "
            f"{found.torque:.1e} Nm, of a mean margin {found.margin:.1e} m; every bound is widened by {WIDENING:g}. With "
            f"confidence 1 - {CONFIDENCE:g}, less than {share:.2g} of the box differs by more",
            flush=True,
        )


if __name__ == "__main__":
    main()
