"""How many Newton steps a leg needs: tried on poses that gaits can ask for, when the robot is loaded."""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.robots.leg import Leg
from nlp_gait.symbolic.general_leg import POSES, make_leg_root, sample_flat_foot_poses
from nlp_gait.symbolic.nonsmooth import Exact

# Nearly all poses are closed to this [1, rad] before the last step, which squares what is left.
NEARLY_CLOSED, CLOSED, SHARE = 1e-9, 1e-12, 0.995
MOST_STEPS = 8


def newton_steps(leg: Leg) -> int:
    """Steps after the guess: none where that is exact, else one more than brings nearly all poses near.

    Raises:
        InputError: more would be needed than are sensible.
    """
    inputs = sample_flat_foot_poses(leg)
    for steps in range(MOST_STEPS):
        left = residuals(leg, steps, inputs)
        if steps == 0 and np.quantile(left, SHARE) <= CLOSED:
            return 0
        if np.quantile(left, SHARE) <= NEARLY_CLOSED:
            return steps + 1
    raise InputError(
        f"the leg of joints {', '.join(leg.joints)} is not solved in {MOST_STEPS} Newton steps: its hip axes pass each other too "
        f"far, or its ankle's; after {MOST_STEPS - 1} steps {100 * float(np.mean(left <= NEARLY_CLOSED)):.0f} % of "
        f"{POSES} poses are closed"
    )


def residuals(leg: Leg, steps: int, inputs: Array) -> Array:
    """(N,) largest residual of each pose after so many steps."""
    symbols = SX.sym("inputs", len(inputs))
    root = make_leg_root(leg, steps, Exact(), SX(0.0))
    left = root.residual(root.newton(symbols), symbols)
    function = ca.Function("residual", [symbols], [left])
    return np.abs(np.array(function.map(inputs.shape[1])(inputs))).max(axis=0)
