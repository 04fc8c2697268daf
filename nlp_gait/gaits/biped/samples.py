"""A phase at its samples: what parts and goals read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import InstantPoint

LEAST_DURATION = 1e-3  # [s]; a shorter phase is evaluated as this one, so that rates stay finite

# What else is seen of an instant, from the variables by name and the phase in [0, 1]: a column.
Trace = Callable[[InstantPoint, SX], SX]


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """A phase at N + 1 samples; columns are samples.

    Attributes:
        joints: rows of torque.
        moving: rows of power and of the motion.
        per_interval: samples in each interval over which a limit on changes holds.
        duration: of the phase [s].
        planned: (k, N + 1) planned angles [rad].
        reach: (2, N + 1) cosines of the knees.
        torque: (J, N + 1) [Nm].
        power: (m, N + 1) mechanical power of the joints that move [W], signed.
        zmp: (2, N + 1) in the world [m].
        motion: angles of the joints that move and both derivatives, (m, N + 1) each; empty if nobody reads them.
        traces: what parts asked to see, by name.
        wrenches: (6, N + 1) of the ground on each sole by side, about the point under the ankle [N, Nm]; empty if nobody reads
            them.
        miss: (k, N + 1) by how much legs miss their feet [m]; empty where they cannot.
    """

    joints: tuple[str, ...]
    moving: tuple[str, ...]
    per_interval: int
    duration: MX
    planned: MX
    reach: MX
    torque: MX
    power: MX
    zmp: MX
    motion: tuple[MX, ...]
    traces: Mapping[str, MX]
    wrenches: Mapping[str, MX] = field(default_factory=dict)
    miss: MX = MX(0, 1)

    @property
    def q(self) -> MX:
        """Angles [rad]."""
        return self.motion[0]

    @property
    def qd(self) -> MX:
        """Rates [rad/s]."""
        return self.motion[1]

    @property
    def qdd(self) -> MX:
        """Accelerations [rad/s^2]."""
        return self.motion[2]

    @property
    def steps(self) -> int:
        """N, one less than the number of samples."""
        return int(self.torque.shape[1]) - 1

    @property
    def step_s(self) -> MX:
        """Time between two samples [s], never zero."""
        return ca.fmax(self.duration, LEAST_DURATION) / self.steps


def time_mean(values: MX) -> MX:
    """Means of rows (m, N + 1) over equidistant samples by the trapezoidal rule."""
    n = values.shape[1]
    weights = np.full(n, 1.0 / (n - 1))
    weights[[0, -1]] /= 2
    return values @ DM(weights)
