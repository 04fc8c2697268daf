"""Instances in the form that optimisers' packages take; packages are imported when they are needed."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from nlp_gait.errors import MissingExtraError, check_name, unknown

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance

CMA_SIGMA = 0.25  # first step, as a share of each variable's range
# A violation of 1 costs this many times the best known objective: ioh adds it to the objective that its algorithms see.
IOH_PENALTY = 1e3


def to_scipy(instance: Instance) -> dict[str, Any]:
    """Return arguments of ``scipy.optimize.minimize``."""
    return {
        "fun": instance.objective,
        "jac": instance.gradient,
        "bounds": list(zip(instance.lower.tolist(), instance.upper.tolist(), strict=True)),
        "constraints": [
            {
                "type": "ineq",  # SciPy's constraints are >= 0
                "fun": lambda x: -instance.rows(np.asarray(x)[None])[0],
                "jac": lambda x: -instance.jacobian(np.asarray(x)),
            }
        ],
    }


def to_cma(instance: Instance) -> dict[str, Any]:
    """Return arguments of ``cma.fmin_con2``."""
    groups = instance.sides.groups
    first = np.array([k for k, group in enumerate(groups) if k == 0 or group != groups[k - 1]])

    def worst_of_groups(x: Any) -> list[float]:
        return np.maximum.reduceat(instance.rows(np.asarray(x)[None])[0], first).tolist()

    return {
        "objective_function": instance.objective,
        "constraints": worst_of_groups,
        "x0": ((instance.lower + instance.upper) / 2).tolist(),
        "sigma0": CMA_SIGMA,
        "options": {
            "bounds": [instance.lower.tolist(), instance.upper.tolist()],
            "CMA_stds": (instance.upper - instance.lower).tolist(),
        },
    }


def to_ioh(instance: Instance) -> Any:
    """Return a problem of ioh."""
    import ioh

    total = ioh.RealConstraint(
        instance.violation,
        weight=IOH_PENALTY * (abs(instance.best_known) or 1.0),
        enforced=ioh.ConstraintEnforcement.SOFT,
        name="violation",
    )
    problem = ioh.wrap_problem(
        instance.objective,
        name=f"GaitBench-{instance.id}",
        problem_class=ioh.ProblemClass.REAL,
        dimension=len(instance.names),
        lb=float(instance.lower.min()),
        ub=float(instance.upper.max()),
        calculate_objective=lambda _, __: ioh.RealSolution(instance.best_x.tolist(), instance.best_known),
        constraints=[total],
    )
    problem.bounds.lb, problem.bounds.ub = instance.lower.tolist(), instance.upper.tolist()
    return problem


def to_pymoo(instance: Instance, *, rows: bool = False) -> Any:
    """Return a problem of pymoo."""
    from nlp_gait.gaitbench.adapters.pymoo import PymooProblem

    return PymooProblem(instance, rows=rows)


# The function that converts an instance, by the name of the package that it needs.
ADAPTERS: dict[str, Callable[..., Any]] = {
    "scipy": to_scipy,
    "cma": to_cma,
    "ioh": to_ioh,
    "pymoo": to_pymoo,
}


def find_adapter(name: str) -> Callable[..., Any]:
    """Return the function that converts an instance for a package; raises UnknownNameError and MissingExtraError."""
    check_name("adapter", name)
    if name not in ADAPTERS:
        raise unknown("adapter", name, ADAPTERS)
    if find_spec(name) is None:
        raise MissingExtraError(
            f"to({name!r}) needs the package {name}, which is not installed: pip install {name}, or all adapters' "
            "packages: pip install 'nlp-gait[algorithms]'"
        )
    return ADAPTERS[name]
