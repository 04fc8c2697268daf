"""Zero-moment point."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
from casadi import DM, SX

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
    (fx, fy, _), (nx, ny, _) = ca.vertsplit(wrench.force), ca.vertsplit(wrench.moment)
    load = ground_load(wrench, weight)
    return ca.vertcat(-(ny + height * fx) / load, (nx - height * fy) / load)  # (eqs. 19, 20)


def ground_load(wrench: Wrench, weight: float) -> SX:
    """Vertical force of the ground [N], at least ``LEAST_LOAD`` of the robot's weight [N]."""
    return ca.fmax(wrench.force[2], LEAST_LOAD * weight)


def combined_zmp(zmps: Sequence[SX], ground_loads: Sequence[SX]) -> SX:
    """ZMP of several feet on one flat ground.

    Args:
        zmps: (2,) of each foot in the world [m].
        ground_loads: vertical force on each foot [N].

    Returns:
        (2,) ZMP in the world [m].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (30), (31).
    """
    moment = sum((p * f for p, f in zip(zmps, ground_loads, strict=True)), SX(2, 1))
    return moment / sum(ground_loads, SX(0))  # (eqs. 30, 31)


def zmp_of_point_masses(masses: DM, p: SX, a: SX, gravity: float, *, static_load: bool = False) -> SX:
    """Zero-moment point of point masses on flat ground at height zero.

    Args:
        masses: (N,) [kg].
        p: (3, N) positions [m], z up.
        a: (3, N) accelerations [m/s^2], gravity excluded.
        gravity: g [m/s^2].
        static_load: take the weight as the ground's load, as eq. (14) does. The moment of gravity and inertia about that point
            vanishes only where the centre of mass has no vertical acceleration.

    Returns:
        (2,) ZMP [m].

    Source:
        Goswami, Vadakkepat, Phung (2008), eqs. (12)-(14).
    """
    weight = gravity * float(ca.sum1(masses))
    vertical = gravity + a[2, :]
    load = weight if static_load else ca.fmax(vertical @ masses, LEAST_LOAD * weight)
    return (p[:2, :] * ca.repmat(vertical, 2, 1) - a[:2, :] * ca.repmat(p[2, :], 2, 1)) @ masses / load  # (eq. 14)
