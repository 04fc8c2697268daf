"""A recorded motion as a phase: torques, balance and every limit at its samples; its duration is the only variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import (
    Constraint,
    InstantPoint,
    NumericPoint,
    Parameter,
    Point,
    RowsOverTime,
    Signals,
    Variable,
)
from nlp_gait.formulation.blocks import make_labels
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes, make_rows
from nlp_gait.gaits.biped.phase import COLUMNS, WRENCHES, Phase
from nlp_gait.gaits.biped.recorded_motion import FINE, Motion, make_instant_function
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Instant, Planner, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

MOVES = 1e-9  # [rad]; a joint that turns by less is held


def _refuse_plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
    raise NotImplementedError("a recorded phase has no plan")


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPhase(Phase):
    """A phase whose angles over time are given, so that it has no plan."""

    recorded: Motion  # the motion, of the same joints
    plan: Planner = _refuse_plan

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        turned = np.ptp(self.recorded.q, axis=0)
        return tuple(name for name, range_rad in zip(self.body.joints, turned, strict=True) if range_rad > MOVES)

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """Return nothing: a recording says nothing about the time between its samples."""
        return ()

    def sample(self, at: Point, ops: Nonsmooth, phases: MX | None = None) -> Samples:
        """Evaluate the phase at N + 1 equidistant samples.

        Traces: ``hip`` (3, N + 1) and ``hip_rate``, ``heights`` (4, N + 1) of the right sole's corners, ``ground`` (2, N + 1),
        the right sole's place [m, m/s].
        """
        q, qd, qdd = (MX(part) for part in self._angles(at))
        torque, zmp, _, hip, hip_rate, ankle, corners, *_ = self._instant.map(self.grid.parts + 1)(q, qd, qdd)
        rows_of = [self.body.joints.index(name) for name in self.moving]
        planned = [self.body.joints.index(name) for name in self.body.planned]
        return Samples(
            joints=self.body.joints,
            moving=self.moving,
            per_interval=self.grid.samples_per_interval,
            duration=at[self.duration],
            planned=q[planned, :],
            reach=self.body.compute_cosines(q),
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
        """Return time histories at a point of numbers; a sole within the tolerance from the ground is on it."""
        q, qd, qdd = self._angles(at)
        n = self.grid.parts + 1
        torque, zmp, torso, _, _, ankle, _, com, *wrenches = (
            np.asarray(DM(part).full().T) for part in self._instant.map(n)(q, qd, qdd)
        )
        support, right = np.array(self.body.support), self.body.robot.feet["right"]
        left_foot = np.tile(support * (1.0, 1.0, 0.0), (n, 1))
        right_foot = ankle - (0.0, 0.0, right.ankle_height_m)
        right_foot[np.abs(right_foot[:, 2]) < GROUND_TOLERANCE.default, 2] = 0.0
        arrays = {
            "t": np.asarray(DM(at[self.duration]).full())[0, 0] * np.linspace(0.0, 1.0, n),
            **{name: np.asarray(DM(part).full().T) for name, part in (("q", q), ("qd", qd), ("qdd", qdd))},
            "tau": torque,
            "zmp": zmp,
            "hip": torso,
            "com": com,
            "left_foot": left_foot,
            "right_foot": right_foot,
            **dict(zip(WRENCHES, (half for wrench in wrenches for half in np.hsplit(wrench, 2)), strict=True)),
        }
        return Signals(joints=self.body.joints, arrays=arrays, columns=COLUMNS)

    def _angles(self, at: Any) -> tuple[Any, Any, Any]:
        """Angles (J, N + 1) and their derivatives, stretched to the phase's duration."""
        recorded, n = self.recorded, self.grid.parts + 1
        times = np.linspace(0.0, recorded.duration_s, n)
        speed = recorded.duration_s / ca.fmax(at[self.duration], LEAST_DURATION)
        q, qd, qdd = (DM(recorded.spline(times, order).T) for order in range(3))
        return q, qd * speed, qdd * speed**2

    @property
    def _instant(self) -> ca.Function:
        return make_instant_function(self.body, self.loads)


CORNERS = ("back right", "back left", "front right", "front left")
# Largest distance of a recorded sole from its place: rounding, and the spline between samples.
GROUND_TOLERANCE = Parameter(
    name="ground_tolerance_m",
    unit="m",
    default=5e-4,
    description="a sole nearer than this to the ground and to its place stands",
    minimum=0.0,
)


class HipLimits(Limit):
    """The hip at both ends within the ranges of the planned motion's variables.

    ``variables`` are those at the start and at the end, by what they limit: ``x``, ``z``, ``vx``, ``vy``, ``vz``.
    """

    def __init__(self, variables: Sequence[Mapping[str, Variable]], labels: Sequence[str]) -> None:
        self._variables, self._labels = variables, labels
        unique = {v.name: v for limits in variables for v in limits.values()}
        self.parameters = make_bound_parameters(tuple(unique.values()))

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
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
        return found, {}


class SwingLimits(Limit):
    """A swinging right foot: on the ground at both ends, above it and next to the other one in between, lifted high enough."""

    def __init__(self, motion: Motion, lift: Variable) -> None:
        self._motion, self._lift = motion, lift
        self.parameters = (GROUND_TOLERANCE, *make_bound_parameters((lift,)))
        self._inner_edge = motion.body.support[1] - motion.body.robot.feet["left"].right_m

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        heights, sides, tolerance = samples.traces["heights"], samples.traces["sides"], at[GROUND_TOLERANCE.name]
        inside = range(1, samples.steps)
        # Of the whole motion, not of the samples alone.
        highest = MX(float(self._motion.right_foot(np.linspace(0.0, self._motion.duration_s, FINE))[:, 2].max()))
        ends = ca.horzcat(heights[:, 0], heights[:, -1])
        lift = self._lift.name
        apart = self._inner_edge - ca.vec(sides[1::2, 1:-1])
        return (
            make_rows(
                "foot_stands", "m", ca.vec(ends), -tolerance, tolerance, make_labels(CORNERS, (0, samples.steps))
            ),
            make_rows("foot_height", "m", ca.vec(heights[:, 1:-1]), -tolerance, labels=make_labels(CORNERS, inside)),
            make_rows("feet_apart", "m", apart, MX(0.0), labels=make_labels(CORNERS[1::2], inside)),
            make_rows("swing_height", "m", highest, at[f"{lift}.lower"], at[f"{lift}.upper"]),
        ), {"swing_height_m": highest}


class StandingLimits(Limit):
    """A right foot that stands: its sole on the ground, and at its mean place."""

    parameters = (GROUND_TOLERANCE,)

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        heights, ground, tolerance = samples.traces["heights"], samples.traces["ground"], at[GROUND_TOLERANCE.name]
        n = samples.steps + 1
        drift = ground - ca.repmat(ca.sum2(ground) / n, 1, n)
        every = range(n)
        return (
            make_rows("foot_stands", "m", ca.vec(heights), -tolerance, tolerance, make_labels(CORNERS, every)),
            make_rows("foot_still", "m", ca.vec(drift), -tolerance, tolerance, make_labels(("x", "y"), every)),
        ), {}


def make_bound_parameters(variables: Sequence[Variable]) -> tuple[Parameter, ...]:
    """Return the bounds of a planned motion's variables as parameters."""
    return tuple(bound for v in variables for bound in (v.bound("lower"), v.bound("upper")))
