"""A flight of stairs that a biped climbs by one tread with each step: its ground, and the swing over its edges."""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import DM, SX
from numpy.polynomial import Polynomial

from nlp_gait.errors import InputError
from nlp_gait.formulation.display import Tread
from nlp_gait.robots import Foot
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion

# Shares of a swing's path over time: forward at rest and unaccelerated at both ends, upward at rest, and its bow.
FORWARD, UPWARD = Polynomial([0, 0, 0, 10, -15, 6]), Polynomial([0, 0, 3, -2])
BOW = Polynomial([0, 0, 16, -32, 16])
CLEARANCE_M = 0.005  # of a swinging sole above the edges, of NAO's size
LEAST_RUN = 1.1  # of a tread, in lengths of the sole
FINE = 1001  # instants at which a swing is compared with the stairs


@dataclass(frozen=True, kw_only=True)
class Flight:
    """Equal treads, each with a foot in its middle; the robot begins in front of the first one."""

    rise_m: float  # of each tread
    run_m: float  # depth of each tread, which is also the step length
    foot: Foot
    clearance_m: float = CLEARANCE_M  # least height of a swinging sole above the edges

    def __post_init__(self) -> None:
        if not 0.0 < self.rise_m < math.inf:
            raise InputError(f"the rise of stairs must be a finite number > 0, got {self.rise_m!r} m")

    def check_run(self, longest_m: float) -> None:
        """Raise InputError if the sole does not fit on a tread, or the robot's longest step is shorter than one."""
        least = LEAST_RUN * (self.foot.back_m + self.foot.front_m)
        if not least <= self.run_m <= longest_m:
            raise InputError(
                f"the run of stairs must be at least {least:.3g} m, {LEAST_RUN:g} lengths of the sole, "
                f"and at most {longest_m:.3g} m, the longest step of this robot; got {self.run_m!r} m"
            )

    @property
    def slope(self) -> float:
        """Rise for each metre."""
        return self.rise_m / self.run_m

    def swing(self, start_x: SX, end_x: SX, lift: SX, duration: SX, s: SX) -> tuple[Motion, Motion]:
        """Return the share of its path that a foot has swung from tread to tread, and its height, with a bow of ``lift`` [m]."""

        def shape(polynomial: Polynomial, factor: SX) -> Motion:
            return Motion(*(factor * ca.polyval(DM(polynomial.deriv(k).coef[::-1]), s) / duration**k for k in range(3)))

        rise = add_motions(constant_motion(self.slope * start_x), shape(UPWARD, self.slope * (end_x - start_x)))
        return shape(FORWARD, SX(1)), add_motions(rise, shape(BOW, lift))

    def find_least_lift(self, treads: int) -> float:
        """Return the least bow of a swing by so many treads, of two if it passes the standing foot, over all edges [m].

        The sole is high enough before its toe has come halfway to an edge.
        """
        s = np.linspace(0.0, 1.0, FINE)[1:-1]
        from_tread = 1 - treads
        toe = (from_tread + treads * FORWARD(s)) * self.run_m + self.foot.front_m + self._free / 4
        below = np.floor((toe + self._setback) / self.run_m) * self.rise_m
        above = (from_tread + treads * UPWARD(s)) * self.rise_m
        return float(np.ceil(1e3 * (np.max((below - above) / BOW(s)) + self.clearance_m)) / 1e3)

    def list_treads(self, count: int) -> tuple[Tread, ...]:
        """Return so many treads, for a robot whose feet begin at x = 0."""
        return tuple(
            Tread(edge_m=k * self.run_m - self._setback, height_m=k * self.rise_m) for k in range(1, count + 1)
        )

    @property
    def _setback(self) -> float:
        """From an edge to the ankle above its tread [m]."""
        return self.foot.back_m + self._free / 2

    @property
    def _free(self) -> float:
        """Depth of a tread that the sole does not cover [m]."""
        return self.run_m - self.foot.back_m - self.foot.front_m
