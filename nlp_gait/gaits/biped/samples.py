"""One instant of a biped, which plans return, and a phase at its samples, which limits and goals read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import casadi as ca
from casadi import DM, MX, SX

from nlp_gait.errors import unknown
from nlp_gait.formulation import Grid, InstantPoint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

BOTH_FEET = {"L": "left", "R": "right"}
LEAST_DURATION = 1e-3  # [s]; a shorter phase is evaluated as this one, so that rates stay finite
CORNERS = ("back right", "back left", "front right", "front left")  # of a sole


class Instant(NamedTuple):
    """Motion of the whole robot at one instant, and the loads that it causes."""

    joints: Mapping[str, Motion]  # motion of every joint by name [rad]
    hip: SX  # (3,) position of the torso's origin [m]
    ankles: Mapping[str, SX]  # (3,) positions by side ``"L"``, ``"R"`` [m]
    reach: SX = SX(0, 1)  # (2,) cosines of the left and the right knee
    yaw: SX = SX(0, 1)  # (1,) yaw of the right foot, from the left one's [rad]; empty where both point forward
    miss: SX = SX(0, 1)  # (k,) distances by which legs miss their feet [m]; empty where they cannot
    attitude: SX = SX(0, 1)  # (4,) of the torso, a unit quaternion (w, x, y, z); empty where it is upright
    quantities: Mapping[str, SX] = {}  # others of this kind of motion by name, columns, which its limits read
    torques: Mapping[str, SX] = {}  # by joint name [Nm]; this and the rest are computed from the motion by a ``Loader``
    zmp: SX = SX(0, 1)  # (2,) in the world [m]
    wrenches: Mapping[str, SX] = {}  # (6,) of the ground on each sole by side, about the point under its ankle [N, Nm]


# From the phase's variables and the reach margin by name, the phase in [0, 1], and an interpretation of acos.
Planner: TypeAlias = Callable[[InstantPoint, SX, Nonsmooth], Instant]
Loader: TypeAlias = Callable[[Instant], Instant]  # adds torques, ZMP and the ground's wrenches to a planned motion


class Quantity:
    """A quantity of samples, read by the name of the attribute."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, samples: "Samples | None", owner: type) -> MX:
        return self if samples is None else samples.read(self._name)


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """A phase at N + 1 samples, whose quantities are read by name; columns are samples."""

    joints: tuple[str, ...]  # rows of torque
    moving: tuple[str, ...]  # rows of power and of the motion
    standing: tuple[str, ...]  # sides of the feet on the ground, ``"L"`` and ``"R"``
    grid: Grid  # of the N + 1 samples
    duration: MX  # of the phase [s]
    progress: MX  # (1, N + 1) shares of the phase's time, from 0 to 1
    values: Mapping[str, MX]  # (k, N + 1) by name of the quantity

    planned = Quantity()  #: (k, N + 1) planned angles [rad]
    reach = Quantity()  #: (2, N + 1) cosines of the knees
    torque = Quantity()  #: (J, N + 1) torques [Nm]
    power = Quantity()  #: (m, N + 1) mechanical power of the joints that move [W], signed
    zmp = Quantity()  #: (2, N + 1) ZMP in the world [m]
    miss = Quantity()  #: (k, N + 1) distances by which legs miss their feet [m]; empty where they cannot
    q = Quantity()  #: (m, N + 1) angles of the joints that move [rad]
    qd = Quantity()  #: (m, N + 1) their velocities [rad/s]
    qdd = Quantity()  #: (m, N + 1) their accelerations [rad/s^2]
    #: (1, N + 1) height of the right sole above the left one [m]; of a sole that may tilt (4, N + 1), of its ``CORNERS``
    swing_heights = Quantity()

    def read(self, name: str) -> MX:
        """Return a quantity (k, N + 1) by name; raises UnknownNameError if this kind of motion does not have it."""
        if name not in self.values:
            raise unknown("quantity of this motion", name, tuple(self.values))
        return self.values[name]

    @property
    def steps(self) -> int:
        """N, one less than the number of samples."""
        return int(self.torque.shape[1]) - 1

    def average(self, values: MX) -> MX:
        """Compute the means of rows (m, N + 1) over time by the grid's rule."""
        return values @ DM(self.grid.weights)

    def average_margins(self, values: MX) -> MX:
        """Compute the mean of balance margins (1, N + 1), by default over samples, all alike, as the paper does."""
        return ca.sum2(values) / (self.steps + 1) if self.grid.rule == "trapezoid" else self.average(values)

    @property
    def step_s(self) -> MX:
        """Time between two samples [s], never zero."""
        return ca.fmax(self.duration, LEAST_DURATION) / self.steps

    def wrench(self, side: str) -> MX:
        """Return the ground's wrench (6, N + 1) on a sole ``"L"`` or ``"R"``, about the point under its ankle [N, Nm]."""
        return self.read(f"wrench_{side}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Placeholders(Samples):
    """Symbols in place of samples, which record what limits and the goal read."""

    rows: Callable[[str], int]  # number of rows of a quantity by name; raises UnknownNameError
    names: list[str] = field(default_factory=list)  # quantities that were read
    values: Mapping[str, MX] = field(default_factory=dict)

    def read(self, name: str) -> MX:
        """Return symbols, and record the name."""
        if name not in self.names:
            self.names.append(name)
        return MX.sym(name, self.rows(name), self.grid.parts + 1)
