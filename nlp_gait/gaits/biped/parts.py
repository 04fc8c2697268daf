"""Parts of a gait: each adds the rows, the parameters and the indexes of one concern."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import Constraint, InstantPoint, Over, Parameter, Point
from nlp_gait.formulation.assembly import parameters as table
from nlp_gait.formulation.blocks import labels
from nlp_gait.gaits.biped.samples import Samples, Trace
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Violations that count alike in the total, by unit: 10 mm of a margin or a height counts like 1 rad, and like a change of a
# foot's load that is too fast by a weight in 0.1 s.
SCALES = {"rad": 1.0, "rad/s": 1.0, "Nm": 1.0, "N": 10.0, "m": 0.01, "1": 1.0, "1/s": 10.0}
REACH_MARGIN = "reach_margin"
TORQUE_CHANGE_NM = 1.2  # of NAO, over one interval
CLOSURE_M = 1e-9  # that a leg may miss its foot by: far below what matters, far above rounding

# Balance margins in x and y, (1, N + 1) each [m], from the ZMP (2, N + 1) [m], the point and an interpretation.
Margins = Callable[[MX, Point, Nonsmooth], tuple[MX, MX]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Contribution:
    """What a part adds to an assembly."""

    rows: tuple[Constraint, ...] = ()
    indexes: Mapping[str, MX] = field(default_factory=dict)


class Part(ABC):
    """One concern of a gait; a part overrides what it has.

    Attributes:
        parameters: its limits.
        reads_motion: whether it reads angles and their derivatives.
        reads_wrenches: whether it reads those of the ground on the soles.
        traces: what else it reads of each instant, by name.
    """

    parameters: tuple[Parameter, ...] = ()
    reads_motion: bool = False
    reads_wrenches: bool = False
    traces: Mapping[str, Trace] = MappingProxyType({})

    @abstractmethod
    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows and indexes at a point."""


def rows(
    name: str,
    unit: str,
    value: MX,
    lower: MX | None = None,
    upper: MX | None = None,
    labels: Sequence[str] = (),
    over: Over | None = None,
    size: float = 1.0,
) -> Constraint:
    """Rows of a part, in which a violation counts as every other in its unit; ``size`` is that of the robot next to NAO's."""
    return Constraint(
        name=name,
        labels=tuple(labels),
        unit=unit,
        scale=size * SCALES[unit],
        value=value,
        lower=lower,
        upper=upper,
        over=over,
    )


class JointLimits(Part):
    """Planned angles within the robot's limits, which are parameters (sections 4.1 and 4.2)."""

    def __init__(self, robot: Robot, planned: tuple[str, ...]) -> None:
        self._planned = planned
        self.parameters = tuple(
            Parameter(
                name=f"{joint}_rad.{end}",
                unit="rad",
                default=robot.joint(joint).planning_limits_rad[side],
                description=f"{end} limit of {joint}",
            )
            for joint in planned
            for side, end in enumerate(("lower", "upper"))
        )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        n = samples.steps + 1
        limits = {end: ca.vertcat(*(at[f"{joint}_rad.{end}"] for joint in self._planned)) for end in ("lower", "upper")}
        lower, upper = (ca.repmat(limit, n, 1) for limit in limits.values())
        names = labels(self._planned, range(n))
        return Contribution(rows=(rows("joint_angle", "rad", ca.vec(samples.planned), lower, upper, names, "instant"),))


class Reach(Part):
    """Knees neither straight nor folded beyond reach: the cosine that gives a knee's angle, off +-1 by a margin."""

    parameters = table(
        (REACH_MARGIN, "1", 0.01, "distance of a knee's cosine from +-1: 0.01 keeps it bent by 0.14 rad", 0.0, 0.5)
    )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        limit = 1 - at[REACH_MARGIN]
        names = labels(("left leg", "right leg"), range(samples.steps + 1))
        return Contribution(rows=(rows("reach", "1", ca.vec(samples.reach), -limit, limit, names, "instant"),))


class Closure(Part):
    """Legs end at their feet, where their angles come from Newton's method; a solver has these equations as its own.

    Args:
        legs: names, as in the rows of ``Samples.miss``.
    """

    def __init__(self, legs: Sequence[str]) -> None:
        self._legs = tuple(legs)

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with an upper bound; a solver, which must have the same rows in the same places, sees them far below it."""
        columns = samples.steps + 1
        miss = ca.vec(samples.miss) if ops.exact else -MX.ones(len(self._legs) * columns)
        names = labels(self._legs, range(columns))
        return Contribution(rows=(rows("closure", "m", miss, upper=MX(CLOSURE_M), labels=names, over="instant"),))


class DriveLimits(Part):
    """What a robot's file says that its joints can give: torque and speed, either sign.

    Args:
        robot: whose joints they are.
        size: of its torques next to NAO's.
    """

    reads_motion = True

    def __init__(self, robot: Robot, size: float) -> None:
        self._robot, self._size = robot, size

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows, and the largest shares of both limits."""
        n = samples.steps + 1
        effort = DM([self._robot.joint(joint).torque_limit_Nm for joint in samples.joints])
        speed = DM([self._robot.joint(joint).velocity_limit_rad_s for joint in samples.moving])
        strongest, fastest = (MX(ca.repmat(limit, n, 1)) for limit in (effort, speed))
        torque, rate = ca.vec(samples.torque), ca.vec(samples.qd)
        return Contribution(
            rows=(
                rows(
                    "effort",
                    "Nm",
                    torque,
                    -strongest,
                    strongest,
                    labels(samples.joints, range(n)),
                    "instant",
                    self._size,
                ),
                rows("joint_speed", "rad/s", rate, -fastest, fastest, labels(samples.moving, range(n)), "instant"),
            ),
            indexes={
                "effort_share": ca.mmax(ca.fabs(torque) / strongest),
                "speed_share": ca.mmax(ca.fabs(rate) / fastest),
            },
        )


class TorqueChange(Part):
    """Change of every torque over an interval of time, limited (sections 4.1 and 4.2).

    Args:
        size: of the robot's torques next to NAO's.
    """

    def __init__(self, size: float = 1.0) -> None:
        self._size = size
        limit = TORQUE_CHANGE_NM if size == 1.0 else float(f"{TORQUE_CHANGE_NM * size:.3g}")
        self.parameters = table(
            ("torque_change_limit_Nm", "Nm", limit, "largest change of a torque over one interval", 0.0, math.inf)
        )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows, and the largest change."""
        step = samples.per_interval
        change = samples.torque[:, step:] - samples.torque[:, :-step]
        limit = at["torque_change_limit_Nm"]
        names = labels(samples.joints, range(change.shape[1]))
        return Contribution(
            rows=(rows("torque_change", "Nm", ca.vec(change), -limit, limit, names, "interval", self._size),),
            indexes={"torque_change_Nm": ca.mmax(ca.fabs(change))},
        )


class BalanceMargins(Part):
    """Dynamic balance margins, at every sample and in the mean (sections 3.1, 3.2, 4.1 and 4.2).

    Args:
        margins: of the phase's ground contact.
        mean_limits_m: default of the least mean margins in x and y [m].
    """

    def __init__(self, margins: Margins, mean_limits_m: tuple[float, float]) -> None:
        self._margins = margins
        x, y = mean_limits_m
        self.parameters = table(
            ("dbm_x_min_limit_m", "m", 0.0, "least balance margin in x", -math.inf, math.inf),
            ("dbm_y_min_limit_m", "m", 0.0, "least balance margin in y", -math.inf, math.inf),
            ("dbm_x_mean_limit_m", "m", x, "least mean margin in x", -math.inf, math.inf),
            ("dbm_y_mean_limit_m", "m", y, "least mean margin in y", -math.inf, math.inf),
        )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with a lower bound; least and mean margins."""
        n = samples.steps + 1
        margins = dict(zip("xy", self._margins(samples.zmp, at, ops), strict=True))
        means = {axis: ca.sum2(margin) / n for axis, margin in margins.items()}
        names = [str(k) for k in range(n)]
        each = [
            rows(f"dbm_{axis}", "m", margin.T, at[f"dbm_{axis}_min_limit_m"], labels=names, over="instant")
            for axis, margin in margins.items()
        ]
        mean = [
            rows(f"dbm_{axis}_mean", "m", value, at[f"dbm_{axis}_mean_limit_m"], over="mean")
            for axis, value in means.items()
        ]
        return Contribution(
            rows=(*each, *mean),
            indexes={
                **{f"dbm_{axis}_min_m": ca.mmin(margin) for axis, margin in margins.items()},
                **{f"dbm_{axis}_mean_m": value for axis, value in means.items()},
            },
        )


class AngleLimits(Part):
    """Angles between the ends of a phase within the robot's limits, where only a richer motion can break them.

    Args:
        name: of the rows.
        robot: whose limits they are.
        joints: names.
        angles: of these joints, a column.
    """

    def __init__(self, name: str, robot: Robot, joints: Sequence[str], angles: Trace) -> None:
        self._name, self._robot, self._joints = name, robot, tuple(joints)
        self.traces = {name: angles}

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        return Contribution(
            rows=(limit_rows(self._name, self._robot, self._joints, samples.traces[self._name][:, 1:-1]),)
        )


def limit_rows(name: str, robot: Robot, joints: tuple[str, ...], angles: MX) -> Constraint:
    """Angles (m, N - 1) of joints between the ends of a phase within the robot's limits [rad]."""
    columns = angles.shape[1]
    lower, upper = (
        MX(DM(np.tile([robot.joint(joint).planning_limits_rad[end] for joint in joints], columns))) for end in (0, 1)
    )
    return rows(name, "rad", ca.vec(angles), lower, upper, labels(joints, range(1, columns + 1)), "instant")


class FootClearance(Part):
    """A planned swing foot above the ground between its ends, and halfway in the middle of its path as high as asked for.

    Args:
        path: (3,) of the foot, height above the ground [m].
        middle: where it is halfway [m].
        least_height: variable that says how high it must be there.
    """

    def __init__(self, path: Trace, middle: float, least_height: str) -> None:
        self._path, self._middle, self._least_height = path, middle, least_height
        self.traces = {"foot": path}

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with a lower bound, and the equation of the middle."""
        n, heights = samples.steps, samples.traces["foot"][2, 1:-1]
        above = rows("foot_height", "m", heights.T, MX(0.0), labels=[str(k) for k in range(1, n)], over="instant")
        halfway = self._halfway(at)
        return Contribution(rows=(above, *halfway_rows(halfway[0], self._middle, halfway[2], at[self._least_height])))

    def _halfway(self, at: Point) -> MX:
        """The foot at half the phase, which is a sample only on some grids."""
        names = [name for name, (kind, _) in at.positions.items() if kind == "x"]
        x = ca.SX.sym("x", len(names))
        function = ca.Function("halfway", [x], [self._path(InstantPoint.of(x, ca.SX(0, 1), names, ()), ca.SX(0.5))])
        return function(at.x)


def halfway_rows(
    along: MX, middle: float, heights: MX, least: MX, corners: tuple[str, ...] = ()
) -> tuple[Constraint, ...]:
    """Where a swing foot is halfway through the phase: in the middle of its path, as in the papers, and high enough.

    Args:
        along: position along the path [m].
        middle: of the path [m].
        heights: (m, 1) of the foot's points [m].
        least: that these may have [m].
        corners: names of the points.
    """
    return (
        rows("foot_middle", "m", along - middle, MX(0.0), MX(0.0), over="once"),
        rows("foot_lift", "m", heights - least, MX(0.0), labels=corners, over="once"),
    )
