"""A recorded motion as a phase: torques, balance and every limit at its samples; its duration is the only variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.problem import Array, Constraint, NumericPoint, Parameter, Point, Signals, Stretch, Variable
from nlp_gait.problem.blocks import labels
from nlp_gait.problems.biped.instant import BOTH_FEET
from nlp_gait.problems.biped.parts import Contribution, Part, rows
from nlp_gait.problems.biped.phase import COLUMNS, WRENCHES, Phase
from nlp_gait.problems.biped.samples import LEAST_DURATION, Samples
from nlp_gait.problems.nao.body import JOINTS, PLANNED_JOINTS
from nlp_gait.problems.nao.free_joints import KNEES
from nlp_gait.problems.nao.recorded.motion import FINE, Motion
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic import trajectories
from nlp_gait.symbolic.economy import economical
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Nonsmooth

CORNERS = ("back right", "back left", "front right", "front left")
MOVES = 1e-9  # [rad]; a joint that turns by less is held
# How far a recorded sole may be from where it should stand: rounding, and the spline between samples.
GROUND_TOLERANCE = Parameter(
    name="ground_tolerance_m",
    unit="m",
    default=5e-4,
    description="a sole nearer than this to the ground, or to where it stood, stands",
    minimum=0.0,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPhase(Phase):
    """A phase whose angles over time are given; ``plan`` is that of the planned phase, and is not used.

    Attributes:
        recorded: the motion.
    """

    recorded: Motion

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        turned = np.ptp(self.recorded.q, axis=0)
        return tuple(name for name, range_rad in zip(JOINTS, turned, strict=True) if range_rad > MOVES)

    def stretch(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[Stretch, ...]:
        """None: between the samples of a recording nothing is known."""
        return ()

    def samples(self, at: Point, ops: Nonsmooth) -> Samples:
        """The phase at N + 1 equidistant samples.

        Traces: ``hip`` (3, N + 1) and ``hip_rate``, ``heights`` (4, N + 1) of the right sole's corners, ``ground`` (2, N + 1),
        the right sole's place [m, m/s].
        """
        q, qd, qdd = (MX(part) for part in self._angles(at))
        torque, zmp, hip, hip_rate, ankle, corners, *_ = self._instant.map(self.grid.parts + 1)(q, qd, qdd)
        rows_of = [JOINTS.index(name) for name in self.moving]
        planned = [JOINTS.index(name) for name in PLANNED_JOINTS]
        return Samples(
            joints=JOINTS,
            moving=self.moving,
            per_interval=self.grid.samples_per_interval,
            duration=at[self.duration],
            planned=q[planned, :],
            reach=ca.cos(q[[JOINTS.index(knee) for knee in KNEES], :]),
            torque=torque,
            power=qd[rows_of, :] * torque[rows_of, :],
            zmp=zmp,
            motion=(q[rows_of, :], qd[rows_of, :], qdd[rows_of, :]),
            traces={
                "hip": hip,
                "hip_rate": hip_rate,
                "heights": corners[2::3, :],
                "sides": corners[1::3, :],
                "ground": ankle[:2, :],
            },
        )

    def signals(self, at: NumericPoint) -> Signals:
        """Time histories at a point of numbers; a sole that is as good as on the ground is on it."""
        q, qd, qdd = self._angles(at)
        n = self.grid.parts + 1
        torque, zmp, hip, _, ankle, _, com, *wrenches = (
            np.asarray(DM(part).full().T) for part in self._instant.map(n)(q, qd, qdd)
        )
        support, right = np.array(self.recorded.support), self.robot.feet["right"]
        left_foot = np.tile(support * (1.0, 1.0, 0.0), (n, 1))
        right_foot = ankle - (0.0, 0.0, right.ankle_height_m)
        right_foot[np.abs(right_foot[:, 2]) < GROUND_TOLERANCE.default, 2] = 0.0
        arrays = {
            "t": np.asarray(DM(at[self.duration]).full())[0, 0] * np.linspace(0.0, 1.0, n),
            **{name: np.asarray(DM(part).full().T) for name, part in (("q", q), ("qd", qd), ("qdd", qdd))},
            "tau": torque,
            "zmp": zmp,
            "hip": hip,
            "com": com,
            "left_foot": left_foot,
            "right_foot": right_foot,
            **dict(zip(WRENCHES, (half for wrench in wrenches for half in np.hsplit(wrench, 2)), strict=True)),
        }
        return Signals(joints=JOINTS, arrays=arrays, columns=COLUMNS)

    def _angles(self, at: Any) -> tuple[Any, Any, Any]:
        """Angles (22, N + 1) and their derivatives, played in the phase's duration."""
        recorded, n = self.recorded, self.grid.parts + 1
        times = np.linspace(0.0, recorded.duration_s, n)
        speed = recorded.duration_s / ca.fmax(at[self.duration], LEAST_DURATION)
        q, qd, qdd = (DM(recorded.spline(times, order).T) for order in range(3))
        return q, qd * speed, qdd * speed**2

    @cached_property
    def _instant(self) -> ca.Function:
        """One sample: from angles and derivatives (22,) to what ``samples`` and ``signals`` read, in the order of the outputs."""
        q, qd, qdd = (SX.sym(name, len(JOINTS)) for name in ("q", "qd", "qdd"))
        torso, ankle, corners, _ = self.recorded.places(q)
        motions = {name: trajectories.Motion(*(part[row] for part in (q, qd, qdd))) for row, name in enumerate(JOINTS)}
        loads = self.loads(motions, torso, {"L": SX(DM(self.recorded.support[:2])), "R": ankle[:2]}, SX(0, 1))
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        tree = tree_from(self.robot, self.robot.feet["left"].link)
        angles = dict(zip(JOINTS, ca.vertsplit(q), strict=True))
        com = centre_of_mass(tree, forward_kinematics(tree, angles, SX(DM(self.recorded.support))))
        outputs = [torque, loads.zmp, torso, ca.jtimes(torso, q, qd), ankle, ca.vec(corners), com]
        outputs += [loads.wrenches[side] for side in BOTH_FEET]
        return ca.Function("instant", [q, qd, qdd], economical(outputs))


class HipLimits(Part):
    """The hip at both ends within the ranges of the planned motion's variables.

    Args:
        variables: by what they limit, ``z``, ``vx``, ``vy``, ``vz`` and more, at the start and at the end; None for no limit.
        labels: of both ends.
    """

    def __init__(self, variables: Sequence[Mapping[str, Variable]], labels: Sequence[str]) -> None:
        self._variables, self._labels = variables, labels
        unique = {v.name: v for limits in variables for v in limits.values()}
        self.parameters = bounds_of(tuple(unique.values()))

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        hip, rate = samples.traces["hip"], samples.traces["hip_rate"]
        found = []
        for end, limits, label in zip((0, hip.shape[1] - 1), self._variables, self._labels, strict=False):
            values = {axis: hip[k, end] for k, axis in enumerate("xyz")}
            values |= {f"v{axis}": rate[k, end] for k, axis in enumerate("xyz")}
            for key, variable in limits.items():
                low, high = at[f"{variable.name}.lower"], at[f"{variable.name}.upper"]
                found.append(
                    Constraint(
                        name=f"hip_{key}_{label}",
                        unit=variable.unit,
                        scale=variable.upper - variable.lower,  # as a bound of the variable itself
                        value=values[key],
                        lower=low,
                        upper=high,
                    )
                )
        return Contribution(rows=tuple(found))


class SwingLimits(Part):
    """A swinging right foot: on the ground at both ends, above it and beside the other one in between, lifted as asked for.

    Args:
        motion: recorded.
        lift: variable that says how high it goes.
    """

    def __init__(self, motion: Motion, lift: Variable) -> None:
        self._motion, self._lift = motion, lift
        self.parameters = (GROUND_TOLERANCE, *bounds_of((lift,)))
        self._inner_edge = motion.support[1] - motion.robot.feet["left"].right_m

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows; the greatest height is of the whole motion, not of the samples alone."""
        heights, sides, tolerance = samples.traces["heights"], samples.traces["sides"], at[GROUND_TOLERANCE.name]
        inside = range(1, samples.steps)
        highest = MX(float(self._motion.right_foot(np.linspace(0.0, self._motion.duration_s, FINE))[:, 2].max()))
        ends = ca.horzcat(heights[:, 0], heights[:, -1])
        lift = self._lift.name
        return Contribution(
            rows=(
                rows("foot_stands", "m", ca.vec(ends), -tolerance, tolerance, labels(CORNERS, (0, samples.steps))),
                rows("foot_height", "m", ca.vec(heights[:, 1:-1]), -tolerance, labels=labels(CORNERS, inside)),
                rows(
                    "feet_apart",
                    "m",
                    self._inner_edge - ca.vec(sides[1::2, 1:-1]),
                    MX(0.0),
                    labels=labels(CORNERS[1::2], inside),
                ),
                rows("swing_height", "m", highest, at[f"{lift}.lower"], at[f"{lift}.upper"]),
            ),
            indexes={"swing_height_m": highest},
        )


class StandingLimits(Part):
    """A right foot that stands: its sole on the ground, and where it is in the mean."""

    parameters = (GROUND_TOLERANCE,)

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        heights, ground, tolerance = samples.traces["heights"], samples.traces["ground"], at[GROUND_TOLERANCE.name]
        n = samples.steps + 1
        drift = ground - ca.repmat(ca.sum2(ground) / n, 1, n)
        every = range(n)
        return Contribution(
            rows=(
                rows("foot_stands", "m", ca.vec(heights), -tolerance, tolerance, labels(CORNERS, every)),
                rows("foot_still", "m", ca.vec(drift), -tolerance, tolerance, labels(("x", "y"), every)),
            )
        )


def bounds_of(variables: Sequence[Variable]) -> tuple[Parameter, ...]:
    """Bounds of a planned motion's variables as parameters."""
    return tuple(bound for v in variables for bound in (v.bound("lower"), v.bound("upper")))


def mean_place(motion: Motion) -> Array:
    """Where the right sole stands in the mean (2,) [m]."""
    foot = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))
    return np.asarray(foot[:, :2].mean(axis=0) + (0.0, motion.support[1]))
