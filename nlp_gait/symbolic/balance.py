"""Zero-moment point, and the wrench between a sole and the ground."""

from collections.abc import Sequence

import casadi as ca
from casadi import DM, SX

from nlp_gait.symbolic.dynamics import Wrench

# In free fall there is no ZMP. With at least this share of the weight as ground force it is far outside any sole, and finite.
LEAST_LOAD = 1e-3


def zmp_of_wrench(wrench: Wrench, height: float, weight: float) -> SX:
    """Return the point on flat ground about which the moment of the ground on the robot has no horizontal component.

    It is the horizontal offset (2,) [m] from the point of the wrench, which is at a height [m] above the ground; weight [N].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (19), (20), with the sign of g made physical and the rotational term as the rate
        of angular momentum about y (in x) and about x (in y); (B.1) to (B.3) in docs/model.
    """
    (fx, fy, _), (nx, ny, _) = ca.vertsplit(wrench.force), ca.vertsplit(wrench.moment)
    load = ground_load(wrench, weight)
    return ca.vertcat(-(ny + height * fx) / load, (nx - height * fy) / load)  # (eqs. 19, 20)


def ground_load(wrench: Wrench, weight: float) -> SX:
    """Return the vertical force of the ground [N], at least ``LEAST_LOAD`` of the robot's weight [N]."""
    return ca.fmax(wrench.force[2], LEAST_LOAD * weight)


def shift_down(wrench: Wrench, height: float) -> SX:
    """Return the wrench (6,) about the point a height [m] below its reference point [N, Nm]."""
    return ca.vertcat(wrench.force, wrench.moment + ca.cross(SX(DM([0.0, 0.0, height])), wrench.force))


def combine_zmps(zmps: Sequence[SX], ground_loads: Sequence[SX]) -> SX:
    """Return the ZMP (2,) of feet on the same flat ground, from their ZMPs (2,) in the world [m] and vertical forces [N].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (30), (31); (B.4) in docs/model.
    """
    moment = sum((p * f for p, f in zip(zmps, ground_loads, strict=True)), SX(2, 1))
    return moment / sum(ground_loads, SX(0))  # (eqs. 30, 31)


def zmp_of_point_masses(masses: DM, p: SX, a: SX, gravity: float, *, static_load: bool = False) -> SX:
    """Return the zero-moment point (2,) [m] of point masses (N,) [kg] on flat ground at height zero.

    Takes their positions (3, N) [m], z up, and accelerations without gravity [m/s^2]. With ``static_load`` the ground's load
    is the weight, as in eq. (14): the moment about that point vanishes only without vertical acceleration of the centre of mass.

    Source:
        Goswami, Vadakkepat, Phung (2008), eqs. (12)-(14); (B.5) and (W.4) in docs/model.
    """
    weight = gravity * float(ca.sum1(masses))
    vertical = gravity + a[2, :]
    load = weight if static_load else ca.fmax(vertical @ masses, LEAST_LOAD * weight)
    return (p[:2, :] * ca.repmat(vertical, 2, 1) - a[:2, :] * ca.repmat(p[2, :], 2, 1)) @ masses / load  # (eq. 14)
