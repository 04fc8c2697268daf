"""Instances as arguments of pycma's ``fmin_con2``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance

SIGMA = 0.25  # first step, as a share of each variable's range


def to_cma(instance: Instance) -> dict[str, Any]:
    """See ``Instance.to_cma``."""
    groups = [name.partition("[")[0].split(" ")[0] for name in instance.row_names]
    first = np.array([k for k, group in enumerate(groups) if k == 0 or group != groups[k - 1]])

    def worst_of_groups(x: Any) -> list[float]:
        return np.maximum.reduceat(instance.rows(np.asarray(x)[None])[0], first).tolist()

    return {
        "objective_function": lambda x: float(instance(np.asarray(x)[None])[0][0]),
        "constraints": worst_of_groups,
        "x0": ((instance.lower + instance.upper) / 2).tolist(),
        "sigma0": SIGMA,
        "options": {
            "bounds": [instance.lower.tolist(), instance.upper.tolist()],
            "CMA_stds": (instance.upper - instance.lower).tolist(),
        },
    }
