"""Limits of a phase: each adds the rows, the parameters and the metrics of one concern; and goals, what a phase minimises."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import unknown
from nlp_gait.formulation import Constraint, InstantPoint, Objective, Over, Parameter, Point
from nlp_gait.formulation.assembly import make_labels
from nlp_gait.formulation.assembly import make_parameters as table
from nlp_gait.gaits.biped.samples import Quantity, Samples
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

# Violations that count alike in the total, by unit: 10 mm of a margin or a height count like 1 rad.
SCALES = {"rad": 1.0, "rad/s": 1.0, "Nm": 1.0, "N": 10.0, "m": 0.01, "1": 1.0, "1/s": 10.0, "N s": 0.1, "Nm s": 0.01}
REACH_MARGIN = "reach_margin"
TORQUE_CHANGE_NM = 1.2  # of NAO, over one interval
LEGS = ("left leg", "right leg")
CLOSURE_M = 1e-9  # by which a leg may miss its foot: far below what matters, far above rounding

Side = TypeVar("Side", float, MX)
# Balance margins in x and y, (1, N + 1) each [m], from the ZMP (2, N + 1) [m], the point and an interpretation.
Margins = Callable[[MX, Point, Nonsmooth], tuple[MX, MX]]

# What a limit adds: rows, and metrics by name.
RowsAndMetrics: TypeAlias = tuple[Sequence[Constraint], Mapping[str, MX]]


class Limit(ABC):
    """What limits a phase; a subclass overrides what it needs."""

    parameters: tuple[Parameter, ...] = ()  # of the limit, which can be changed without rebuilding
    # Quantities of the samples that are evaluated with those of every phase; any other takes an evaluation more.
    reads: tuple[Quantity, ...] = ()

    @abstractmethod
    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        """Return the rows at a point, and metrics by name."""


def make_rows(
    name: str,
    unit: str,
    value: MX,
    lower: MX | None = None,
    upper: MX | None = None,
    labels: Sequence[str] = (),
    over: Over | None = None,
    size: float = 1.0,
) -> Constraint:
    """Make rows with the scale of their unit; ``size`` is that of the robot's quantity relative to NAO's.

    Raises UnknownNameError for a unit without a scale.
    """
    if unit not in SCALES:
        raise unknown("unit of rows", unit, SCALES)
    names, scale = tuple(labels), size * SCALES[unit]
    return Constraint(name=name, labels=names, unit=unit, scale=scale, value=value, lower=lower, upper=upper, over=over)


def make_rows_at_samples(
    name: str, unit: str, values: MX, names: Sequence[str], lower: MX | None, upper: MX | None = None, *, first: int = 0
) -> Constraint:
    """Make rows of all instants from a matrix (k, n) of samples from number ``first``; limits are scalars or (k n, 1)."""
    numbers = range(first, first + values.shape[1])
    return make_rows(name, unit, ca.vec(values), lower, upper, make_labels(names, numbers), "instant")


class JointLimits(Limit):
    """Planned angles within the robot's limits, which are parameters (sections 4.1 and 4.2)."""

    def __init__(self, robot: Robot, planned: tuple[str, ...]) -> None:
        self._planned = planned
        bounds = [(robot.joint(joint).planning_limits_rad, joint) for joint in planned]
        self.parameters = tuple(
            Parameter(name=f"{joint}_rad.{end}", unit="rad", default=value, description=f"{end} limit of {joint}")
            for both, joint in bounds
            for end, value in zip(("lower", "upper"), both, strict=True)
        )

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        n = samples.steps + 1
        limits = (ca.vertcat(*(point[f"{joint}_rad.{end}"] for joint in self._planned)) for end in ("lower", "upper"))
        lower, upper = (ca.repmat(limit, n, 1) for limit in limits)
        return [make_rows_at_samples("joint_angle", "rad", samples.planned, self._planned, lower, upper)], {}


class Reach(Limit):
    """Knees neither straight nor folded: the cosine of a knee's angle stays off +-1 by a margin."""

    parameters = table(
        (REACH_MARGIN, "1", 0.01, "distance of a knee's cosine from +-1: 0.01 keeps it bent by 0.14 rad", 0.0, 0.5)
    )

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        limit = 1 - point[REACH_MARGIN]
        return [make_rows_at_samples("reach", "1", samples.knee_cosine, LEGS, -limit, limit)], {}


class Closure(Limit):
    """Contact-closure error of legs whose angles Newton's method computes; gradient solvers enforce closure as equations."""

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        # A gradient solver needs the same rows in the same places: there they are far below their bound.
        closure_error = samples.closure_error if ops.exact else -MX.ones(len(LEGS), samples.steps + 1)
        return [make_rows_at_samples("closure", "m", closure_error, LEGS, None, MX(CLOSURE_M))], {}


class DriveLimits(Limit):
    """Torque and speed of every joint within the limits of the robot's file; ``size`` scales NAO's torques."""

    reads = (Samples.qd,)

    def __init__(self, robot: Robot, size: float) -> None:
        self._robot, self._size = robot, size

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        joint = self._robot.joint
        efforts = [joint(name).torque_limit_Nm for name in samples.joints]
        speeds = [joint(name).velocity_limit_rad_s for name in samples.moving]
        effort, effort_share = _limit("effort", "Nm", samples.torque, samples.joints, efforts, self._size)
        speed, speed_share = _limit("joint_speed", "rad/s", samples.qd, samples.moving, speeds)
        return (*effort, *speed), {"effort_share": effort_share, "speed_share": speed_share}


def _limit(
    name: str, unit: str, values: MX, joints: Sequence[str], limits: Sequence[float], size: float = 1.0
) -> tuple[list[Constraint], MX]:
    """Return the rows of samples (J, n) within +- limits (J,), which may be infinite, and the largest share of a limit."""
    limited = [k for k, limit in enumerate(limits) if limit < math.inf]
    if not limited:
        return [], MX(0.0)
    if len(limited) < len(limits):
        values = values[limited, :]
    largest = MX(ca.repmat(DM([limits[k] for k in limited]), values.shape[1], 1))
    labels = make_labels([joints[k] for k in limited], range(values.shape[1]))
    value = ca.vec(values)
    row = make_rows(name, unit, value, -largest, largest, labels, "instant", size)
    return [row], ca.mmax(ca.fabs(value) / largest)


class TorqueChange(Limit):
    """Largest change of every torque over an interval of time (sections 4.1 and 4.2); ``size`` scales NAO's torques."""

    def __init__(self, size: float = 1.0) -> None:
        self._size = size
        limit = TORQUE_CHANGE_NM if size == 1.0 else float(f"{TORQUE_CHANGE_NM * size:.3g}")
        self.parameters = table(
            ("torque_change_limit_Nm", "Nm", limit, "largest change of a torque over one interval", 0.0, math.inf)
        )

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        step = samples.grid.samples_per_interval
        change = samples.torque[:, step:] - samples.torque[:, :-step]
        limit = point["torque_change_limit_Nm"]
        names = make_labels(samples.joints, range(change.shape[1]))
        return [make_rows("torque_change", "Nm", ca.vec(change), -limit, limit, names, "interval", self._size)], {
            "torque_change_Nm": ca.mmax(ca.fabs(change))
        }


class Box(NamedTuple, Generic[Side]):
    """Sides of a rectangle [m]."""

    back: Side
    front: Side
    right: float
    left: float


def compute_margins(box: Box[float] | Box[MX], zmp: MX, ops: Nonsmooth) -> tuple[MX, MX]:
    """Compute the distances (1, N + 1) of the ZMP (2, N + 1) to the sides of a box in x and in y [m]."""
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(box.front - x, x - box.back).T, ops.min(box.left - y, y - box.right).T


class BalanceMargins(Limit):
    """Least balance margins at samples, by default ``least_m``, and in the mean, in x and y [m] (sections 3.1 to 4.2)."""

    def __init__(
        self, margins: Margins, mean_limits_m: tuple[float, float], least_m: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        self._margins = margins
        (x, y), (least_x, least_y) = mean_limits_m, least_m
        self.parameters = table(
            ("dbm_x_min_limit_m", "m", least_x, "least balance margin in x", -math.inf, math.inf),
            ("dbm_y_min_limit_m", "m", least_y, "least balance margin in y", -math.inf, math.inf),
            ("dbm_x_mean_limit_m", "m", x, "least mean margin in x", -math.inf, math.inf),
            ("dbm_y_mean_limit_m", "m", y, "least mean margin in y", -math.inf, math.inf),
        )

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        n = samples.steps + 1
        margins = dict(zip("xy", self._margins(samples.zmp, point, ops), strict=True))
        means = {axis: samples.average_margins(margin) for axis, margin in margins.items()}
        names = [str(k) for k in range(n)]
        least = [
            make_rows(f"dbm_{axis}", "m", margin.T, point[f"dbm_{axis}_min_limit_m"], labels=names, over="instant")
            for axis, margin in margins.items()
        ]
        mean = [
            make_rows(f"dbm_{axis}_mean", "m", value, point[f"dbm_{axis}_mean_limit_m"], over="mean")
            for axis, value in means.items()
        ]
        return (*least, *mean), {
            **{f"dbm_{axis}_min_m": ca.mmin(margin) for axis, margin in margins.items()},
            **{f"dbm_{axis}_mean_m": value for axis, value in means.items()},
        }


class ArmLimits(Limit):
    """Angles of swinging arms within the robot's limits between the ends, which a cubic cannot break."""

    reads = (Samples.arm_angle,)

    def __init__(self, robot: Robot, joints: Sequence[str]) -> None:
        self._joints = tuple(joints)
        self._limits = np.array([robot.joint(joint).planning_limits_rad for joint in joints])

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        angles = samples.arm_angle[:, 1:-1]
        lower, upper = (MX(DM(np.tile(limits, angles.shape[1]))) for limits in self._limits.T)
        return [make_rows_at_samples("arm_angle", "rad", angles, self._joints, lower, upper, first=1)], {}


class SplineClearance(Limit):
    """Height of a planned swing foot: positive between its ends, and a least height at half time, when x is ``middle`` [m]."""

    reads = (Samples.swing_heights,)

    def __init__(self, path: Callable[[InstantPoint, ca.SX], ca.SX], middle: float, least_height: str) -> None:
        self._path, self._middle, self._least_height = path, middle, least_height

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        n, heights = samples.steps, samples.swing_heights[1:-1]
        above = make_rows("foot_height", "m", heights.T, MX(0.0), labels=[str(k) for k in range(1, n)], over="instant")
        # Half the phase is a sample only on some grids.
        names = [name for name, (kind, _) in point.positions.items() if kind == "x"]
        x = ca.SX.sym("x", len(names))
        path = self._path(InstantPoint.of(x, ca.SX(0, 1), names, ()), ca.SX(0.5))
        halfway = ca.Function("halfway", [x], [path])(point.x)
        return (above, *make_halfway_rows(halfway[0], self._middle, halfway[2], point[self._least_height])), {}


def make_halfway_rows(
    along: MX, middle: float, heights: MX, least: MX, corners: tuple[str, ...] = ()
) -> tuple[Constraint, ...]:
    """Make rows for a swing foot halfway: in the middle of its path, as in the papers, and high enough at ``corners`` [m]."""
    return (
        make_rows("foot_middle", "m", along - middle, MX(0.0), MX(0.0), over="once"),
        make_rows("foot_lift", "m", heights - least, MX(0.0), labels=corners, over="once"),
    )


POWER = Objective(name="power", unit="W")
HEAT_LOSS = Parameter(
    name="heat_loss_W_per_Nm2", unit="W/(Nm)^2", default=0.025, description="K, heat loss (eq. 32)", minimum=0.0
)


def compute_paper_power(point: Point, samples: Samples, ops: Nonsmooth) -> MX:
    """Compute the mean electrical power over time [W]: braking costs like driving, one K (eq. 32; (P.1), (P.2))."""
    mechanical = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    return samples.average(ca.sum1(mechanical) + point[HEAT_LOSS.name] * ca.sum1(samples.torque**2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Goal:
    """What a phase minimises: a function of its samples."""

    objective: Objective  # its name and unit
    compute: Callable[[Point, Samples, Nonsmooth], MX]
    formula: str = ""  # of ``docs/model/power.md``
    reads: tuple[Quantity, ...] = ()  # see ``Limit.reads``

    def evaluate(self, point: Point, samples: Samples, ops: Nonsmooth) -> tuple[MX, Mapping[str, MX]]:
        """Return the objective and the metrics: power, and what is minimised instead."""
        value = self.compute(point, samples, ops)
        if self.objective is POWER:
            return value, {"power_W": value}
        return value, {"power_W": compute_paper_power(point, samples, Exact()), self.objective.name: value}


def _average_squared_rate(values: MX, samples: Samples) -> MX:
    return ca.sumsqr(values[:, 1:] - values[:, :-1]) / samples.step_s**2 / samples.steps


GoalName = Literal["power", "jerk", "torque", "torque-smoothness"]
GOALS: Mapping[GoalName, Goal] = {
    "power": Goal(objective=POWER, compute=compute_paper_power),
    "jerk": Goal(
        objective=Objective(name="joint_jerk", unit="rad^2/s^6"),
        compute=lambda point, samples, ops: _average_squared_rate(samples.qdd, samples),
        formula=r"\frac{1}{N} \sum_{k=1}^{N} \sum_j \left( \frac{\ddot{q}_{j,k} - \ddot{q}_{j,k-1}}{h} \right)^2",
        reads=(Samples.qdd,),
    ),
    "torque": Goal(
        objective=Objective(name="squared_torque", unit="(Nm)^2"),
        compute=lambda point, samples, ops: samples.average(ca.sum1(samples.torque**2)),
        formula=r"\overline{\sum_j \tau_j^2}",
    ),
    "torque-smoothness": Goal(
        objective=Objective(name="torque_rate", unit="(Nm/s)^2"),
        compute=lambda point, samples, ops: _average_squared_rate(samples.torque, samples),
        formula=r"\frac{1}{N} \sum_{k=1}^{N} \sum_j \left( \frac{\tau_{j,k} - \tau_{j,k-1}}{h} \right)^2",
    ),
}
