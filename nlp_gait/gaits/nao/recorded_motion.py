"""A motion that is given as angles over time: its splines on the left foot, its phases, and where the robot's parts are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.nao.body import JOINTS, RESTING_ARM_ANGLES
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

LEAST_ROWS = 5
SAME_TIME_S = 1e-9
LIFTED_M = 2e-3  # [m]; a foot that rises by less stands
STILL_M = 1e-5  # [m]; a foot nearer than this to its last place has landed, or than SCATTER times its noise
SCATTER = 4.0 * math.sqrt(2.0)  # standard deviations of the difference of two places, four of them
FAR = 4.0  # a swing's end is fitted from the instant at this multiple of the distance of a still foot
NOISE_RAD = 1e-5  # smaller ones are ignored: angles with five decimals
LARGEST_ANGLE = 4.0 * math.pi  # [rad]; larger ones are degrees, and those beyond half a turn wrapped
LARGEST_PERIOD_S = 0.5  # between two rows; larger ones are milliseconds
LEAST_SHARE = 0.02  # of the time; a shorter phase does not count
CLOSED_RAD = 1e-3  # [rad]; a motion repeats if its end is nearer than this to the mirror image of its beginning
MEDIAN = 0.6745  # of the absolute value of a standard normal variable
FINE = 400  # instants at which a whole motion is evaluated


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedMotion:
    """A motion of all joints of the gait on the left foot."""

    body: Body
    t: Array  # (T,) [s], from zero
    q: Array  # (T, J) angles of the body's joints [rad]
    mirrored: bool = False  # the file's left is this motion's right
    held: tuple[str, ...] = ()  # joints that the file leaves out

    @property
    def duration_s(self) -> float:
        """Duration of the whole motion."""
        return float(self.t[-1])

    @cached_property
    def spline(self) -> CubicSpline:
        """Angles over time; continuous accelerations."""
        from scipy.interpolate import CubicSpline  # takes longer to import than everything else

        return CubicSpline(self.t, self.q)

    def cut(self, start_s: float, end_s: float) -> RecordedMotion:
        """Return the motion between two times, smoothed, from the samples in between alone: accelerations may jump at its ends.

        Noisy joints follow the smoothest quintic splines that leave no more than their noise. Raises InputError for too few
        samples.
        """
        within = (self.t > start_s - SAME_TIME_S) & (self.t < end_s + SAME_TIME_S)
        count = np.count_nonzero(within)
        if count < LEAST_ROWS:
            raise InputError(f"the phase from {start_s:g} s to {end_s:g} s has {count} samples; it needs {LEAST_ROWS}")
        rows, samples = self.t[within], self.q[within]
        inside = rows[(rows > start_s + SAME_TIME_S) & (rows < end_s - SAME_TIME_S)]
        times = np.array([start_s, *inside, end_s])
        from scipy.interpolate import BSpline, CubicSpline, splrep

        q = CubicSpline(rows, samples)(times)
        for k in np.flatnonzero(self.noise_rad):
            squares = (count + math.sqrt(2.0 * count)) * self.noise_rad[k] ** 2  # FITPACK's manual: at most
            q[:, k] = BSpline(*splrep(rows, samples[:, k], k=min(5, count - 1), s=squares, quiet=1))(times)
        return replace(self, t=times - start_s, q=q)

    @cached_property
    def noise_rad(self) -> Array:
        """Standard deviation (J,) of noise and rounding of each joint, zero where it is small.

        A few dozen samples of one joint say little: none is taken to be measured better than half of the noisy ones.
        """
        noise = estimate_noise(self.q)
        noisy = noise > NOISE_RAD
        return np.where(noisy, np.maximum(noise, np.median(noise[noisy])), 0.0) if noisy.any() else np.zeros(len(noise))

    def right_foot(self, times: Array) -> Array:
        """Return the right sole under its ankle relative to the left one (T, 3): ahead, to the left, and above [m]."""
        (_, left_y, _), (_, height) = self.body.support, self.body.ankle("R")
        ankle = make_places_function(self.body).map(len(times))(DM(self.spline(times).T))[0].full().T
        return np.asarray(ankle - (0.0, left_y, height))

    def mirror_image(self) -> RecordedMotion:
        """Exchange left and right."""
        columns, signs = self.body.mirror
        return replace(self, q=signs * self.q[:, columns], mirrored=not self.mirrored)

    @property
    def repeats(self) -> bool:
        """Whether the end is the mirror image of the beginning, so that another step can follow."""
        closed = np.maximum(CLOSED_RAD, SCATTER * estimate_noise(self.q))
        return bool((np.abs(self.q[-1] - self.mirror_image().q[0]) < closed).all())

    def phases(self, touch_down_s: float | None = None) -> dict[Support, tuple[float, float]]:
        """Return start and end [s] of single and double support, or of one if there is only one."""
        end = self.duration_s
        if touch_down_s is not None:
            if not 0.0 < touch_down_s < end:
                raise InputError(f"touch-down must be within the motion's {end:g} s, got {touch_down_s:g}")
            return {Support.SINGLE: (0.0, touch_down_s), Support.DOUBLE: (touch_down_s, end)}
        foot = self.right_foot(self.t)
        scatter = SCATTER * float(np.linalg.norm(estimate_noise(foot)))
        lifted = LIFTED_M + 2.0 * scatter
        if foot[:, 2].max() < lifted and np.ptp(foot[:, :2], axis=0).max() < lifted:
            return {Support.DOUBLE: (0.0, end)}
        landing = self._landing(foot, max(STILL_M, scatter))
        if end - landing < LEAST_SHARE * end:
            return {Support.SINGLE: (0.0, end)}
        return {Support.SINGLE: (0.0, landing), Support.DOUBLE: (landing, end)}

    def _landing(self, foot: Array, still: float) -> float:
        """Estimate when a foot at places (T, 3) [m] lands, by least squares: a parabola ends a swing at rest, then it stands."""
        distance = np.linalg.norm(foot - foot[-1], axis=1)
        last = int(np.flatnonzero(distance >= still)[-1])
        begin = int(np.flatnonzero(distance[: last + 1] > FAR * still)[-1:].sum())
        begin = max(min(begin, last - 2), 0)
        t, places = self.t[begin:], foot[begin:]

        def miss(landing: float) -> float:
            columns = np.column_stack([np.ones(len(t)), np.maximum(landing - t, 0.0) ** 2])
            return float(np.square(places - columns @ np.linalg.lstsq(columns, places)[0]).sum())

        return float(min(t[2:].tolist(), key=miss, default=t[-1]))


def estimate_noise(samples: Array) -> Array:
    """Return the standard deviation (n,) of noise and rounding in samples (T, n) of a smooth motion.

    High differences of equal steps contain hardly anything else; the order whose median is least, since a coarsely sampled
    motion leaves a part of itself in the lower ones.
    """
    if len(samples) < 2 * LEAST_ROWS:
        return np.zeros(samples.shape[1])
    estimates = [
        np.median(np.abs(np.diff(samples, order, axis=0)), axis=0) / (math.sqrt(math.comb(2 * order, order)) * MEDIAN)
        for order in (4, 6, 8)
    ]
    return np.asarray(np.min(estimates, axis=0))


def count_swings(heights: Array, lifted: float) -> int:
    """Return how often the right foot or the left one swings, from the height (T,) of the right foot above the left one [m]."""
    signs = np.sign(heights[np.abs(heights) > lifted])
    return 1 + int(np.count_nonzero(np.diff(signs)))


class FreeParts(NamedTuple):
    """Places of what does not stand."""

    torso: SX  # (3,) origin of the torso [m]
    ankle: SX  # (3,) of the right foot [m]
    corners: SX  # (3, 4) of the right sole [m]
    rotation: SX  # (3, 3) from the torso's axes


def locate_free_parts(robot: Robot, q: Mapping[str, SX], support: tuple[float, float, float]) -> FreeParts:
    """Return the places of torso and right foot of a robot with its left ankle at ``support`` [m], from joint angles [rad]."""
    tree = make_tree(robot, robot.feet["left"].link)
    poses = forward_kinematics(tree, q, SX(DM(support)))
    by_link = {body.link.name: pose for body, pose in zip(tree, poses, strict=True)}
    torso, foot = by_link[robot.root], robot.feet["right"]
    entry = next(body.joint for body in tree if body.link.name == robot.root)
    assert entry is not None  # the torso is not the fixed link; for the type checker
    ankle = by_link[foot.link]
    corners = [
        (along, across, -foot.ankle_height_m)
        for along in (-foot.back_m, foot.front_m)
        for across in (-foot.right_m, foot.left_m)
    ]
    return FreeParts(
        torso.position - torso.rotation @ DM(entry.origin_m),
        ankle.position,
        ca.repmat(ankle.position, 1, 4) + ankle.rotation @ DM(np.array(corners).T),
        torso.rotation,
    )


@lru_cache(maxsize=8)
def make_places_function(body: Body) -> ca.Function:
    """Return the function of angles (J,) to the right ankle (3,) [m], and the cosine of the torso's lean."""
    q = SX.sym("q", len(body.joints))
    places = locate_free_parts(body.robot, dict(zip(body.joints, ca.vertsplit(q), strict=True)), body.support)
    return ca.Function("places", [q], [places.ankle, places.rotation[2, 2]])


def read_motion(angles: JointAngles, body: Body) -> RecordedMotion:
    """Return the motion of a robot on its left foot; mirrored if the right one stands. Arms that are missing are held.

    Raises InputError if a joint of the legs is missing, or times or angles are missing or out of order.
    """
    missing = [name for name in JOINTS if name not in angles.joints]
    needed = [name for name in missing if name not in RESTING_ARM_ANGLES]
    if needed:
        raise InputError(f"{angles.owner} has no angles of {', '.join(needed)}")
    if len(angles.t) < LEAST_ROWS:
        raise InputError(f"{angles.owner} has {len(angles.t)} rows; a motion needs {LEAST_ROWS}")
    check_times(angles)
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    for name in JOINTS:
        if name in columns and not np.isfinite(columns[name]).all():
            raise InputError(f"{angles.owner}: an angle of {name} is missing")
    check_angles(angles)
    columns |= {name: np.full(len(angles.t), RESTING_ARM_ANGLES[name]) for name in missing}
    q = np.column_stack([columns[name] for name in JOINTS])
    motion = RecordedMotion(body=body, t=angles.t - angles.t[0], q=q, held=tuple(missing))
    heights = motion.right_foot(motion.t)[:, 2]
    steps = count_swings(heights, LIFTED_M + SCATTER * float(estimate_noise(heights[:, None])[0]))
    if steps > 1:
        raise InputError(
            f"{angles.owner} shows {steps} steps; one is judged: cut it from the lift-off of a foot to that of the other"
        )
    return motion.mirror_image() if -heights.min() > max(heights.max(), LIFTED_M) else motion


def check_times(angles: JointAngles) -> None:
    """Raise InputError unless times ascend, in seconds."""
    if not np.isfinite(angles.t).all():
        raise InputError(f"{angles.owner}: a time is missing")
    periods = np.diff(angles.t)
    row = int(periods.argmin())
    if not periods[row] > 0.0:
        before, after = angles.t[row : row + 2]
        raise InputError(
            f"{angles.owner}: times must ascend, got {after:g} s after {before:g} s; remove one of the rows"
        )
    if (period := float(np.median(periods))) > LARGEST_PERIOD_S:
        raise InputError(
            f"{angles.owner}: rows are {period:g} s apart, at most {LARGEST_PERIOD_S:g} s are allowed. Milliseconds? "
            "Name their column 't [ms]'"
        )


def check_angles(angles: JointAngles) -> None:
    """Raise InputError for angles that are degrees, or jump by whole turns."""
    row, column = np.unravel_index(np.nanargmax(np.abs(angles.q)), angles.q.shape)
    name, largest = angles.joints[column], angles.q[row, column]
    if abs(largest) > LARGEST_ANGLE:
        raise InputError(
            f"{angles.owner}: {name} is {largest:.4g} rad at {angles.t[row]:g} s. Degrees? Name the column '{name} [deg]'"
        )
    if abs(largest) > math.pi:
        raise InputError(
            f"{angles.owner}: {name} is {largest:.4g} rad at {angles.t[row]:g} s, beyond half a turn. Wrapped? Add or subtract "
            "2 pi where it jumps, so that angles are continuous and within +-pi"
        )
