"""A motion that is given as angles over time: as splines on the left foot, and which phases they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from casadi import DM
from scipy.interpolate import CubicSpline

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.biped.recorded.stance import Stance
from nlp_gait.robots.mirror import mirror_sign

LEAST_ROWS = 5
SAME_TIME_S = 1e-9
LIFTED = 2e-3  # [m]; a foot that rises by less stands
STILL = 1e-5  # [m]; a foot that is nearer than this to where it ends has landed
LEAST_SHARE = 0.02  # of the time; a shorter phase is none
CLOSED = 1e-3  # [rad]; a motion whose end is nearer than this to the mirror image of its beginning can go on
FINE = 400  # instants at which a whole motion is looked at


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A motion of all joints of the gait on the left foot.

    Attributes:
        stance: the robot.
        t: (T,) [s], from zero.
        q: (T, J) angles of its joints [rad].
        mirrored: the file's left is this motion's right.
        held: joints that the file leaves out.
    """

    stance: Stance
    t: Array
    q: Array
    mirrored: bool = False
    held: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Of the whole motion."""
        return float(self.t[-1])

    @cached_property
    def spline(self) -> CubicSpline:
        """Angles over time; continuous accelerations."""
        return CubicSpline(self.t, self.q)

    def part(self, start_s: float, end_s: float) -> Motion:
        """The motion between two times, from the samples in between alone: accelerations may jump at its ends."""
        own = (self.t > start_s - SAME_TIME_S) & (self.t < end_s + SAME_TIME_S)
        count = np.count_nonzero(own)
        if count < LEAST_ROWS:
            raise InputError(f"the phase from {start_s:g} s to {end_s:g} s has {count} samples; it needs {LEAST_ROWS}")
        rows = self.t[own]
        inside = rows[(rows > start_s + SAME_TIME_S) & (rows < end_s - SAME_TIME_S)]
        times = np.array([start_s, *inside, end_s])
        q = CubicSpline(rows, self.q[own])(times)
        return replace(self, t=times - start_s, q=q)

    def right_foot(self, times: Array) -> Array:
        """Right sole under its ankle against the left one (T, 3): ahead, to the left, and above [m]."""
        height = self.stance.robot.feet["right"].ankle_height_m
        ankle = self.stance.places.map(len(times))(DM(self.spline(times).T))[2].full().T
        return np.asarray(ankle - (0.0, self.stance.support[1], height))

    def mirror_image(self) -> Motion:
        """The motion with left and right exchanged."""
        joints, images = self.stance.joints, self.stance.images
        columns = [joints.index(name) for name in images]
        signs = np.array([mirror_sign(self.stance.robot, *pair) for pair in zip(joints, images, strict=True)])
        return replace(self, q=signs * self.q[:, columns], mirrored=not self.mirrored)

    @property
    def repeats(self) -> bool:
        """Whether the end is the mirror image of the beginning, so that another step can follow."""
        return bool(np.abs(self.q[-1] - self.mirror_image().q[0]).max() < CLOSED)

    def phases(self, touch_down_s: float | None = None) -> dict[str, tuple[float, float]]:
        """Beginning and end [s] of single support ``"ssp"`` and double support ``"dsp"``, as far as there are both."""
        end = self.duration_s
        if touch_down_s is not None:
            if not 0.0 < touch_down_s < end:
                raise InputError(f"touch-down must be within the motion's {end:g} s, got {touch_down_s:g}")
            return {"ssp": (0.0, touch_down_s), "dsp": (touch_down_s, end)}
        foot = self.right_foot(self.t)
        if foot[:, 2].max() < LIFTED and np.ptp(foot[:, :2], axis=0).max() < LIFTED:
            return {"dsp": (0.0, end)}
        landing = self._landing(np.linalg.norm(foot - foot[-1], axis=1))
        if end - landing < LEAST_SHARE * end:
            return {"ssp": (0.0, end)}
        return {"ssp": (0.0, landing), "dsp": (landing, end)}

    def _landing(self, distance: Array) -> float:
        """When a foot lands, from its distance to where it ends (T,) [m]: a swing that ends at rest comes in as a parabola."""
        last = int(np.flatnonzero(distance >= STILL)[-1])
        before = max(last - 2, 0)
        near, far = np.sqrt(distance[[last, before]])
        late = 0.0 if far <= near else near * (self.t[last] - self.t[before]) / (far - near)
        return float(self.t[np.argmin(np.abs(self.t - (self.t[last] + late)))])


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedGait:
    """A gait from elsewhere, as a problem whose only variables are its times.

    Attributes:
        gait: name of the problem whose limits it is judged by.
        problem: the recorded gait; its variables are the durations of its phases, and of a cycle the step length.
        x: (n,) its own durations and step.
        motion: on the left foot.
        step_m: from foot to foot.
        lean_deg: of the torso at the beginning.
        make_planned: makes the planned problem with the same robot, step and durations; InputError if there is none.
    """

    gait: str
    problem: GaitProblem
    x: tuple[float, ...]
    motion: Motion
    step_m: float
    lean_deg: float
    make_planned: Callable[[], GaitProblem]
