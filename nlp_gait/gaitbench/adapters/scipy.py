"""Instances as arguments of ``scipy.optimize.minimize``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


def to_scipy(instance: Instance) -> dict[str, Any]:
    """See ``Instance.to_scipy``."""
    return {
        "fun": lambda x: float(instance(np.asarray(x)[None])[0][0]),
        "jac": instance.gradient,
        "bounds": list(zip(instance.lower.tolist(), instance.upper.tolist(), strict=True)),
        "constraints": [
            {
                "type": "ineq",  # SciPy wants what is not negative
                "fun": lambda x: -instance.rows(np.asarray(x)[None])[0],
                "jac": lambda x: -instance.jacobian(np.asarray(x)),
            }
        ],
    }
