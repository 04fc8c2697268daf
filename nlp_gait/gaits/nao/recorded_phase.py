"""Phases of NAO on its left foot along recorded angles, so that torso and right foot follow from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import NumericPoint, Point, Signals
from nlp_gait.formulation.assembly import Parameter, RowsOverTime
from nlp_gait.gaits.biped.phase import IN_TIME, Phase
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Instant, Planner, Quantity, SampledMotion
from nlp_gait.gaits.nao.body import KNEES
from nlp_gait.gaits.nao.recorded_motion import RecordedMotion, locate_free_parts
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.tape import simplify
from nlp_gait.symbolic.trajectories import Motion

MOVES = 1e-9  # [rad]; a joint that turns by less is held
# Largest distance of a recorded sole from its place: rounding, and the spline between samples.
GROUND_TOLERANCE = Parameter(
    name="ground_tolerance_m",
    unit="m",
    default=5e-4,
    description="a sole nearer than this to the ground and to its place stands",
    minimum=0.0,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPhase(Phase):
    """A phase whose angles over time are given, stretched to its duration; its soles may tilt."""

    recorded: RecordedMotion  # the motion, of the body's joints
    plan: Planner = field(init=False)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        turned = np.ptp(self.recorded.q, axis=0)
        return tuple(name for name, range_rad in zip(self.body.joints, turned, strict=True) if range_rad > MOVES)

    @cached_property
    def _joint_symbols(self) -> SX:
        return SX.sym("v", 3 * len(self.body.joints))

    @cached_property
    def _exact_now(self) -> Instant:
        v, count = self._joint_symbols, len(self.body.joints)
        joints = {name: Motion(v[i], v[count + i], v[2 * count + i]) for i, name in enumerate(self.body.joints)}
        instant = self.loads(place_on_left_foot(self, joints))
        hip_rate = ca.jtimes(instant.hip, v[:count], v[count : 2 * count])
        return instant._replace(hip_rate=hip_rate)

    def _evaluate(self, points: Sequence[Point], ops: Nonsmooth, phases: MX | None) -> SampledMotion:
        def evaluate(quantities: Sequence[Quantity]) -> Sequence[MX]:
            columns = [self._evaluate_quantities(quantities, point) for point in points]
            return [ca.horzcat(*(values[quantity] for values in columns)) for quantity in quantities]

        motion = SampledMotion(evaluate, len(points))
        motion.store(self.usual, evaluate(self.usual))
        return motion

    def _evaluate_histories(self, point: NumericPoint, phases: DM) -> dict[Quantity, Any]:
        return self._evaluate_quantities(IN_TIME, point)

    def _evaluate_quantities(self, quantities: Sequence[Quantity], point: Any) -> dict[Quantity, Any]:
        """Return quantities: of single joints from the recording, all others by one function of these."""
        times = np.linspace(0.0, self.recorded.duration_s, self.grid.parts + 1)
        speed = self.recorded.duration_s / ca.fmax(point[self.duration], LEAST_DURATION)
        angles, rates, accelerations = (DM(self.recorded.spline(times, order).T) for order in range(3))
        motions = ca.vertcat(angles, rates * speed, accelerations * speed**2)
        outputs = [quantity.measure(self, self._exact_now) for quantity in quantities]
        if isinstance(motions, MX):  # a function that is evaluated once is not worth it
            outputs = simplify(outputs)
        columns = ca.Function("instant", [self._joint_symbols], outputs).map(len(times)).call([motions])
        return dict(zip(quantities, columns, strict=True))

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """Return nothing: a recording says nothing about the time between its samples."""
        return ()

    def signals(self, point: NumericPoint) -> Signals:
        """Return time histories at a point of numbers; a sole within the tolerance from the ground is on it."""
        signals = super().signals(point)
        heights = signals.arrays["right_foot"][:, 2]
        heights[np.abs(heights) < GROUND_TOLERANCE.default] = 0.0
        return signals


def place_on_left_foot(phase: Phase, joints: Mapping[str, Motion]) -> Instant:
    """Return the motion of a phase's robot on its left foot, from that of its joints."""
    body = phase.body
    places = locate_free_parts(body.robot, {name: motion.position for name, motion in joints.items()}, body.support)
    return Instant(
        joints=joints,
        hip=places.torso,
        ankles={"L": SX(DM(body.support)), "R": places.ankle},
        knee_cosine=ca.vertcat(*(ca.cos(joints[knee].position) for knee in KNEES)),
        heights=places.corners[2, :].T,
        sides=places.corners[1, 1::2].T,
    )
