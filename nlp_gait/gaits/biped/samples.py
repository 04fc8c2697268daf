"""One instant of a biped, which plans return, and a phase at its samples, which limits and goals read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import InstantPoint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

BOTH_FEET = {"L": "left", "R": "right"}
LEAST_DURATION = 1e-3  # [s]; a shorter phase is evaluated as this one, so that rates stay finite


class Instant(NamedTuple):
    """Motion of the whole robot at one instant, and the loads that it causes."""

    joints: Mapping[str, Motion]  # motion of every joint by name [rad]
    hip: SX  # (3,) position of the torso's origin [m]
    ankles: Mapping[str, SX]  # (3,) positions by side ``"L"``, ``"R"`` [m]
    reach: SX = SX(0, 1)  # (2,) cosines of the left and the right knee
    # (6,) of the ground on the right sole, about the point under its ankle [N, Nm]; empty unless planned
    wrench: SX = SX(0, 1)
    yaw: SX = SX(0, 1)  # (1,) yaw of the right foot, from the left one's [rad]; empty where both point forward
    miss: SX = SX(0, 1)  # (k,) distances by which legs miss their feet [m]; empty where they cannot
    attitude: SX = SX(0, 1)  # (4,) of the torso, a unit quaternion (w, x, y, z); empty where it is upright
    torques: Mapping[str, SX] = {}  # by joint name [Nm]; this and the rest are computed from the motion by a ``Loader``
    zmp: SX = SX(0, 1)  # (2,) in the world [m]
    wrenches: Mapping[str, SX] = {}  # (6,) of the ground on each sole by side, about the point under its ankle [N, Nm]


# From the phase's variables and the reach margin by name, the phase in [0, 1], and an interpretation of acos.
Planner: TypeAlias = Callable[[InstantPoint, SX, Nonsmooth], Instant]
Loader: TypeAlias = Callable[[Instant], Instant]  # adds torques, ZMP and the ground's wrenches to a planned motion
# Another quantity at an instant, a column, from the variables by name and the phase in [0, 1].
Trace: TypeAlias = Callable[[InstantPoint, SX], SX]


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """A phase at N + 1 samples; columns are samples."""

    joints: tuple[str, ...]  # rows of torque
    moving: tuple[str, ...]  # rows of power and of the motion
    per_interval: int  # samples in each interval over which changes are limited
    duration: MX  # of the phase [s]
    planned: MX  # (k, N + 1) planned angles [rad]
    reach: MX  # (2, N + 1) cosines of the knees
    torque: MX  # (J, N + 1) [Nm]
    power: MX  # (m, N + 1) mechanical power of the joints that move [W], signed
    zmp: MX  # (2, N + 1) in the world [m]
    traces: Mapping[str, MX]  # quantities that limits requested, by name
    # (6, N + 1) of the ground on each sole by side, about the point under the ankle [N, Nm]; empty unless a limit reads them
    wrenches: Mapping[str, MX] = field(default_factory=dict)
    miss: MX = MX(0, 1)  # (k, N + 1) distances by which legs miss their feet [m]; empty where they cannot
    # Angles of the joints that move and both derivatives, (m, N + 1) each; empty unless a limit or the goal reads them
    q: MX = MX(0, 1)
    qd: MX = MX(0, 1)
    qdd: MX = MX(0, 1)

    @property
    def steps(self) -> int:
        """N, one less than the number of samples."""
        return int(self.torque.shape[1]) - 1

    @property
    def step_s(self) -> MX:
        """Time between two samples [s], never zero."""
        return ca.fmax(self.duration, LEAST_DURATION) / self.steps


def average_over_time(values: MX) -> MX:
    """Compute the means of rows (m, N + 1) over equidistant samples by the trapezoidal rule."""
    n = values.shape[1]
    weights = np.full(n, 1.0 / (n - 1))
    weights[[0, -1]] /= 2
    return values @ DM(weights)
