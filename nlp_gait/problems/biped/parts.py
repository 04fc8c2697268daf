"""Parts of a gait: each adds the rows, the parameters and the indexes of one concern."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.problem import Constraint, InstantPoint, Parameter, Point
from nlp_gait.problems.biped.samples import Samples, Trace, labels
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Violations that count alike in the total: 1 rad, 1 Nm, 10 mm of a margin or a height, 1 in the cosine of a knee.
ANGLE_SCALE, TORQUE_SCALE, MARGIN_SCALE, HEIGHT_SCALE, REACH_SCALE = 1.0, 1.0, 0.01, 0.01, 1.0
REACH_MARGIN = "reach_margin"

# Balance margins in x and y, (1, N + 1) each [m], from the ZMP (2, N + 1) [m], the point and an interpretation.
Margins = Callable[[MX, Point, Nonsmooth], tuple[MX, MX]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Contribution:
    """What a part adds to an assembly."""

    rows: tuple[Constraint, ...] = ()
    indexes: Mapping[str, MX] = field(default_factory=dict)


class Part:
    """One concern of a gait; a part overrides what it has.

    Attributes:
        parameters: its limits.
        reads_motion: whether it reads angles and their derivatives.
        traces: what else it reads of each instant, by name.
    """

    parameters: tuple[Parameter, ...] = ()
    reads_motion: bool = False
    traces: Mapping[str, Trace] = MappingProxyType({})

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows and indexes at a point."""
        raise NotImplementedError


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
        lower, upper = (ca.vertcat(*(at[f"{j}_rad.{end}"] for j in self._planned)) for end in ("lower", "upper"))
        row = Constraint(
            name="joint_angle",
            labels=labels(self._planned, _columns(n)),
            unit="rad",
            scale=ANGLE_SCALE,
            value=ca.vec(samples.planned),
            lower=ca.repmat(lower, n, 1),
            upper=ca.repmat(upper, n, 1),
        )
        return Contribution(rows=(row,))


class Reach(Part):
    """Knees neither straight nor folded beyond reach: the cosine that gives a knee's angle, off +-1 by a margin."""

    parameters = (
        Parameter(
            name=REACH_MARGIN,
            unit="1",
            default=0.01,
            description="distance of a knee's cosine from +-1: 0.01 keeps it bent by 0.14 rad",
            minimum=0.0,
            maximum=0.5,
        ),
    )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        limit = 1 - at[REACH_MARGIN]
        row = Constraint(
            name="reach",
            labels=labels(("left leg", "right leg"), _columns(samples.steps + 1)),
            unit="1",
            scale=REACH_SCALE,
            value=ca.vec(samples.reach),
            lower=-limit,
            upper=limit,
        )
        return Contribution(rows=(row,))


class TorqueChange(Part):
    """Change of every torque over an interval of time, limited (sections 4.1 and 4.2)."""

    parameters = (
        Parameter(
            name="torque_change_limit_Nm",
            unit="Nm",
            default=1.2,
            description="largest change of a torque over one interval",
            minimum=0.0,
        ),
    )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows, and the largest change."""
        step = samples.per_interval
        change = samples.torque[:, step:] - samples.torque[:, :-step]
        limit = at["torque_change_limit_Nm"]
        row = Constraint(
            name="torque_change",
            labels=labels(samples.joints, _columns(change.shape[1])),
            unit="Nm",
            scale=TORQUE_SCALE,
            value=ca.vec(change),
            lower=-limit,
            upper=limit,
        )
        return Contribution(rows=(row,), indexes={"torque_change_Nm": ca.mmax(ca.fabs(change))})


class BalanceMargins(Part):
    """Dynamic balance margins, at every sample and in the mean (sections 3.1, 3.2, 4.1 and 4.2).

    Args:
        margins: of the phase's ground contact.
        mean_limits_m: default of the least mean margins in x and y [m].
    """

    def __init__(self, margins: Margins, mean_limits_m: tuple[float, float]) -> None:
        self._margins = margins
        self.parameters = (
            *(
                Parameter(
                    name=f"dbm_{axis}_min_limit_m", unit="m", default=0.0, description=f"least balance margin in {axis}"
                )
                for axis in "xy"
            ),
            *(
                Parameter(
                    name=f"dbm_{axis}_mean_limit_m", unit="m", default=least, description=f"least mean margin in {axis}"
                )
                for axis, least in zip("xy", mean_limits_m, strict=True)
            ),
        )

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with a lower bound; least and mean margins."""
        n = samples.steps + 1
        margins = dict(zip("xy", self._margins(samples.zmp, at, ops), strict=True))
        means = {axis: ca.sum2(margin) / n for axis, margin in margins.items()}
        each = [
            Constraint(
                name=f"dbm_{axis}",
                labels=tuple(_columns(n)),
                unit="m",
                scale=MARGIN_SCALE,
                value=margin.T,
                lower=at[f"dbm_{axis}_min_limit_m"],
            )
            for axis, margin in margins.items()
        ]
        mean = [
            Constraint(
                name=f"dbm_{axis}_mean",
                unit="m",
                scale=MARGIN_SCALE,
                value=value,
                lower=at[f"dbm_{axis}_mean_limit_m"],
            )
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
    return Constraint(
        name=name,
        labels=labels(joints, [str(k) for k in range(1, columns + 1)]),
        unit="rad",
        scale=ANGLE_SCALE,
        value=ca.vec(angles),
        lower=lower,
        upper=upper,
    )


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
        above = Constraint(
            name="foot_height",
            labels=tuple(str(k) for k in range(1, n)),
            unit="m",
            scale=HEIGHT_SCALE,
            value=heights.T,
            lower=MX(0.0),
        )
        halfway = self._halfway(at)
        rows = halfway_rows(halfway[0], self._middle, halfway[2], at[self._least_height])
        return Contribution(rows=(above, *rows))

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
        Constraint(
            name="foot_middle", unit="m", scale=HEIGHT_SCALE, value=along - middle, lower=MX(0.0), upper=MX(0.0)
        ),
        Constraint(
            name="foot_lift", labels=corners, unit="m", scale=HEIGHT_SCALE, value=heights - least, lower=MX(0.0)
        ),
    )


def _columns(count: int) -> list[str]:
    return [str(k) for k in range(count)]
