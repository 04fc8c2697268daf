"""Zero-moment point."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from nlp_gait.symbolic.dynamics import Wrench

# In free fall there is no ZMP. Below this share of the weight the ground force is taken as this share: the ZMP is then
# far outside any sole, and finite.
LEAST_LOAD = 1e-3


def zmp_of_wrench(wrench: Wrench, height: float, weight: float) -> SX:
    """Point on flat ground about which the ground's moment on the robot has no horizontal part.

    Includes the rate of angular momentum of every body.

    Args:
        wrench: of the ground on the robot, about a point ``height`` above the ground.
        height: [m].
        weight: of the robot [N].

    Returns:
        (2,) horizontal offset from that point [m].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (19), (20), with the sign of g made physical and the rotational term as the rate
        of angular momentum about y (in x) and about x (in y).
    """
    (fx, fy, fz), (nx, ny, _) = ca.vertsplit(wrench.force), ca.vertsplit(wrench.moment)
    load = ca.fmax(fz, LEAST_LOAD * weight)
    return ca.vertcat(-(ny + height * fx) / load, (nx - height * fy) / load)
