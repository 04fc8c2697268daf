"""One instant of a biped, which plans return, and a phase at its samples, which limits and goals read."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, overload

import casadi as ca
from casadi import DM, MX, SX

from nlp_gait.errors import unknown
from nlp_gait.formulation import Grid, InstantPoint
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
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
    knee_cosine: SX = SX(0, 1)  # (2,) cosines of the left and the right knee
    yaw: SX = SX(0, 1)  # (1,) yaw of the right foot, from the left one's [rad]; empty where both point forward
    closure_error: SX = SX(0, 1)  # (k,) distances by which legs miss their feet [m]; empty where they cannot
    attitude: SX = SX(0, 1)  # (4,) of the torso, a unit quaternion (w, x, y, z); empty where it is upright
    arm_angle: SX = SX(0, 1)  # (k,) of the arms that swing [rad]
    heights: SX = SX(0, 1)  # (4,) of the corners of a right sole that may tilt [m]; empty where it stays flat
    sides: SX = SX(0, 1)  # (2,) y of its left corners [m]
    hip_rate: SX = SX(0, 1)  # (3,) velocity of the torso's origin [m/s], of recorded motions
    torques: Mapping[str, SX] = {}  # by joint name [Nm]; this and the rest are computed from the motion by a ``Loader``
    zmp: SX = SX(0, 1)  # (2,) in the world [m]
    wrenches: Mapping[str, SX] = {}  # (6,) of the ground on each sole by side, about the point under its ankle [N, Nm]


# From the phase's variables and the reach margin by name, the phase in [0, 1], and an interpretation of acos.
Planner: TypeAlias = Callable[[InstantPoint, SX, Nonsmooth], Instant]
Loader: TypeAlias = Callable[[Instant], Instant]  # adds torques, ZMP and the ground's wrenches to a planned motion


class Quantity:
    """A quantity of one instant; as an attribute of samples, it is evaluated at all of them when it is first read."""

    def __init__(self, measure: Callable[[Any, Instant], SX], *, of_motion: bool = False) -> None:
        self.measure = measure  #: (k,) from a ``Phase`` and an instant of it
        self.of_motion = of_motion  #: whether it follows from the planned motion without derivatives and loads

    @overload
    def __get__(self, samples: None, owner: type) -> "Quantity": ...
    @overload
    def __get__(self, samples: "Samples", owner: type) -> MX: ...
    def __get__(self, samples: "Samples | None", owner: type) -> "Quantity | MX":
        return self if samples is None else samples.evaluate(self)


def _stack(now: Instant, joints: Sequence[str], order: int) -> SX:
    return ca.vertcat(*(now.joints[name][order] for name in joints))


def _locate_sole(phase: Any, now: Instant, side: str) -> SX:
    """Return the point (3,) of a flat sole under its ankle [m]."""
    return now.ankles[side] - SX([0, 0, phase.body.robot.feet[BOTH_FEET[side]].ankle_height_m])


def _locate_mass(phase: Any, now: Instant) -> SX:
    tree = make_tree(phase.body.robot, phase.body.robot.feet["left"].link)
    angles = {name: joint.position for name, joint in now.joints.items()}
    return centre_of_mass(tree, forward_kinematics(tree, angles, now.ankles["L"]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """A phase at N + 1 samples; columns are samples.

    Each phase has its own frame, in the axes of the ground: x forward, y to the left from the middle of the robot, z up from the
    sole of the left foot, which stands while the right one swings; a step on the other foot is the mirror image. In cycles and
    walks x = 0 is below the left ankle, in a single phase where the right foot lifts off: read places relative to a foot.
    """

    joints: tuple[str, ...]  # rows of torque
    moving: tuple[str, ...]  # rows of power and of the motion
    standing: tuple[str, ...]  # sides of the feet on the ground, ``"L"`` and ``"R"``
    grid: Grid  # of the N + 1 samples
    duration: MX  # of the phase [s]
    progress: MX  # (1, N + 1) shares of the phase's time, from 0 to 1
    evaluate: Callable[[Quantity], MX]  # a quantity at all samples

    #: (k, N + 1) planned angles [rad]
    planned = Quantity(lambda phase, now: _stack(now, phase.body.planned, 0), of_motion=True)
    knee_cosine = Quantity(lambda _, now: now.knee_cosine, of_motion=True)  #: (2, N + 1) cosines of the knees
    torque = Quantity(lambda phase, now: ca.vertcat(*(now.torques[n] for n in phase.body.joints)))  #: (J, N + 1) [Nm]
    #: (m, N + 1) mechanical power of the joints that move [W], signed
    power = Quantity(lambda phase, now: ca.vertcat(*(now.joints[n].velocity * now.torques[n] for n in phase.moving)))
    zmp = Quantity(lambda _, now: now.zmp)  #: (2, N + 1) ZMP in the world [m]
    #: (k, N + 1) distances by which legs miss their feet [m]; empty where they cannot
    closure_error = Quantity(lambda _, now: now.closure_error, of_motion=True)
    q = Quantity(lambda phase, now: _stack(now, phase.moving, 0))  #: (m, N + 1) angles of the joints that move [rad]
    qd = Quantity(lambda phase, now: _stack(now, phase.moving, 1))  #: (m, N + 1) their velocities [rad/s]
    qdd = Quantity(lambda phase, now: _stack(now, phase.moving, 2))  #: (m, N + 1) their accelerations [rad/s^2]
    all_q = Quantity(lambda phase, now: _stack(now, phase.body.joints, 0))  #: (J, N + 1) angles of all joints [rad]
    all_qd = Quantity(lambda phase, now: _stack(now, phase.body.joints, 1))  #: (J, N + 1) their velocities [rad/s]
    all_qdd = Quantity(lambda phase, now: _stack(now, phase.body.joints, 2))  #: (J, N + 1) [rad/s^2]
    wrench_left = Quantity(lambda _, now: now.wrenches["L"])  #: (6, N + 1), see ``wrench``
    wrench_right = Quantity(lambda _, now: now.wrenches["R"])  #: (6, N + 1)
    hip = Quantity(lambda _, now: now.hip, of_motion=True)  #: (3, N + 1) torso's origin in the world [m]
    com = Quantity(_locate_mass, of_motion=True)  #: (3, N + 1) centre of mass [m]
    #: (3, N + 1) points of flat soles below the ankles [m]
    left_foot = Quantity(lambda phase, now: _locate_sole(phase, now, "L"), of_motion=True)
    right_foot = Quantity(lambda phase, now: _locate_sole(phase, now, "R"), of_motion=True)  #: likewise
    #: (1, N + 1) height of the right sole above the left one [m]; of a sole that may tilt (4, N + 1), of its ``CORNERS``
    swing_heights = Quantity(
        lambda phase, now: now.heights if now.heights.numel() else _locate_sole(phase, now, "R")[2], of_motion=True
    )
    #: (2, N + 1) y of the left corners of a sole that may tilt [m]
    sides = Quantity(lambda _, now: now.sides, of_motion=True)
    #: (3, N + 1) velocity of the torso's origin [m/s], of recorded motions
    hip_rate = Quantity(lambda _, now: now.hip_rate)
    #: (k, N + 1) angles of the arms that swing [rad]
    arm_angle = Quantity(lambda _, now: now.arm_angle, of_motion=True)
    #: (4, N + 1) attitude of the torso, a unit quaternion (w, x, y, z); empty where it is upright
    attitude = Quantity(lambda _, now: now.attitude, of_motion=True)
    yaw = Quantity(lambda _, now: now.yaw, of_motion=True)  #: (1, N + 1) of the right foot [rad]; empty without a turn

    if not TYPE_CHECKING:  # a type checker finds unknown names

        def __getattr__(self, name: str) -> MX:
            known = [key for key, value in vars(type(self)).items() if isinstance(value, Quantity)]
            raise unknown("quantity of samples", name, known)

    @property
    def steps(self) -> int:
        """N, one less than the number of samples."""
        return int(self.progress.shape[1]) - 1

    def average(self, values: MX) -> MX:
        """Compute the means of rows (m, N + 1) over time by the trapezoidal rule."""
        return values @ DM(self.grid.weights)

    def average_margins(self, values: MX) -> MX:
        """Compute the mean of balance margins (1, N + 1) over samples, all alike, as the paper does."""
        return ca.sum2(values) / (self.steps + 1)

    @property
    def step_s(self) -> MX:
        """Time between two samples [s], never zero."""
        return ca.fmax(self.duration, LEAST_DURATION) / self.steps

    def wrench(self, side: str) -> MX:
        """Return the ground's wrench (6, N + 1) on a sole ``"L"`` or ``"R"``, about the point under its ankle [N, Nm]."""
        return self.wrench_left if side == "L" else self.wrench_right


# Of every phase.
USUAL = (
    Samples.planned,
    Samples.knee_cosine,
    Samples.torque,
    Samples.power,
    Samples.zmp,
    Samples.closure_error,
)


class SampledMotion:
    """Quantities of a phase at the samples of several points; each is evaluated once, when it is first read."""

    def __init__(self, evaluate: Callable[[Sequence[Quantity]], Sequence[MX]], count: int) -> None:
        self.evaluate, self._count = evaluate, count  # quantities at the samples of all points, side by side
        self._values: dict[Quantity, list[MX]] = {}

    def store(self, quantities: Sequence[Quantity], columns: Sequence[MX]) -> None:
        """Store the values (k, P (N + 1)) of quantities."""
        for quantity, values in zip(quantities, columns, strict=True):
            self._values[quantity] = ca.horzsplit(values, values.shape[1] // self._count)

    def read(self, point: int, quantity: Quantity) -> MX:
        """Return a quantity at a point by its number."""
        if quantity not in self._values:
            self.store([quantity], self.evaluate([quantity]))
        return self._values[quantity][point]
