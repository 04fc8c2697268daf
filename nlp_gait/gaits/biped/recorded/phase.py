"""A recorded motion as a phase: torques, balance and every limit at its samples; its duration is the only variable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.formulation import NumericPoint, Point, RowsOverTime, Signals
from nlp_gait.gaits.biped.phase import COLUMNS, WRENCHES, Phase
from nlp_gait.gaits.biped.recorded.limits import GROUND_TOLERANCE
from nlp_gait.gaits.biped.recorded.motion import Motion
from nlp_gait.gaits.biped.recorded.stance import instant_of
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

MOVES = 1e-9  # [rad]; a joint that turns by less is held


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPhase(Phase):
    """A phase whose angles over time are given; ``plan`` is that of the planned phase, and is not used.

    Attributes:
        recorded: the motion, of the same joints.
        cosines: of both knees (2, N + 1), as the planned phase has them, from angles (J, N + 1).
    """

    recorded: Motion
    cosines: Callable[[MX], MX]

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        turned = np.ptp(self.recorded.q, axis=0)
        return tuple(name for name, range_rad in zip(self.joints, turned, strict=True) if range_rad > MOVES)

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """None: between the samples of a recording nothing is known."""
        return ()

    def samples(self, at: Point, ops: Nonsmooth) -> Samples:
        """The phase at N + 1 equidistant samples.

        Traces: ``hip`` (3, N + 1) and ``hip_rate``, ``heights`` (4, N + 1) of the right sole's corners, ``ground`` (2, N + 1),
        the right sole's place [m, m/s].
        """
        q, qd, qdd = (MX(part) for part in self._angles(at))
        torque, zmp, _, hip, hip_rate, ankle, corners, *_ = self._instant.map(self.grid.parts + 1)(q, qd, qdd)
        rows_of = [self.joints.index(name) for name in self.moving]
        planned = [self.joints.index(name) for name in self.planned]
        return Samples(
            joints=self.joints,
            moving=self.moving,
            per_interval=self.grid.samples_per_interval,
            duration=at[self.duration],
            planned=q[planned, :],
            reach=self.cosines(q),
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
        torque, zmp, torso, _, _, ankle, _, com, *wrenches = (
            np.asarray(DM(part).full().T) for part in self._instant.map(n)(q, qd, qdd)
        )
        support, right = np.array(self.recorded.stance.support), self.robot.feet["right"]
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
        return Signals(joints=self.joints, arrays=arrays, columns=COLUMNS)

    def _angles(self, at: Any) -> tuple[Any, Any, Any]:
        """Angles (J, N + 1) and their derivatives, played in the phase's duration."""
        recorded, n = self.recorded, self.grid.parts + 1
        times = np.linspace(0.0, recorded.duration_s, n)
        speed = recorded.duration_s / ca.fmax(at[self.duration], LEAST_DURATION)
        q, qd, qdd = (DM(recorded.spline(times, order).T) for order in range(3))
        return q, qd * speed, qdd * speed**2

    @property
    def _instant(self) -> ca.Function:
        """One sample."""
        return instant_of(self.recorded.stance, self.loads)
