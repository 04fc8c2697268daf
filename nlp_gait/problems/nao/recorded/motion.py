"""Joint angles over time, made by anybody: as splines on the left foot, and which phases they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, SX
from scipy.interpolate import CubicSpline

from nlp_gait.errors import InputError
from nlp_gait.problem import Array
from nlp_gait.problems.nao.body import HELD_ARM_ANGLES, JOINTS
from nlp_gait.problems.nao.free_joints import free_parts
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import mirror_sign, partner
from nlp_gait.robots.tree import tree_from

LEAST_ROWS = 5
SAME_TIME_S = 1e-9
LIFTED = 2e-3  # [m]; a foot that rises by less stands
STILL = 1e-5  # [m]; a foot that is nearer than this to where it ends has landed
LEAST_SHARE = 0.02  # of the time; a shorter phase is none
CLOSED = 1e-3  # [rad]; a motion whose end is nearer than this to the mirror image of its beginning can go on
FINE = 400  # instants at which a whole motion is looked at
# Joints of the arms that a file may leave out: they are held as in the paper, section 3.1 and in the middle of Table 3.
LEFT_OUT = HELD_ARM_ANGLES | {"LShoulderPitch": 1.5, "RShoulderPitch": 1.5, "LElbowRoll": -0.53, "RElbowRoll": 0.53}


@dataclass(frozen=True, kw_only=True, eq=False)
class JointAngles:
    """Angles of some joints over time.

    Attributes:
        owner: the file, for messages.
        joints: names of the columns.
        t: (T,) ascending [s].
        q: (T, J) [rad].
    """

    owner: str
    joints: tuple[str, ...]
    t: Array
    q: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A motion of all joints of the gait on the left foot.

    Attributes:
        robot: with links welded that never move.
        t: (T,) [s], from zero.
        q: (T, 22) angles, columns as ``JOINTS`` [rad].
        mirrored: the file's left is this motion's right.
        held: joints that the file leaves out.
    """

    robot: Robot
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
        return Motion(robot=self.robot, t=times - start_s, q=q, mirrored=self.mirrored, held=self.held)

    @cached_property
    def support(self) -> tuple[float, float, float]:
        """Left ankle, which stands below its own hip joint at x = 0 [m]."""
        geometry = leg_geometry(self.robot, "L")
        return 0.0, geometry.hip_m[1], geometry.ankle_height_m

    @cached_property
    def places(self) -> ca.Function:
        """From angles (22,) to torso (3,), right ankle (3,), corners of the right sole (3, 4) [m], and cosine of the lean."""
        q = SX.sym("q", len(JOINTS))
        tree = tree_from(self.robot, self.robot.feet["left"].link)
        parts = free_parts(self.robot, tree, dict(zip(JOINTS, ca.vertsplit(q), strict=True)), self.support)
        return ca.Function("places", [q], [parts.torso, parts.ankle, parts.corners, parts.upright])

    def right_foot(self, times: Array) -> Array:
        """Right sole under its ankle against the left one (T, 3): ahead, to the left, and above [m]."""
        height = self.robot.feet["right"].ankle_height_m
        ankle = self.places.map(len(times))(DM(self.spline(times).T))[1].full().T
        return np.asarray(ankle - (0.0, self.support[1], height))

    def mirror_image(self) -> Motion:
        """The motion with left and right exchanged."""
        columns = [JOINTS.index(partner(name)) for name in JOINTS]
        signs = np.array([mirror_sign(self.robot, name) for name in JOINTS])
        return Motion(
            robot=self.robot, t=self.t, q=signs * self.q[:, columns], mirrored=not self.mirrored, held=self.held
        )

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


def motion_of(angles: JointAngles, robot: Robot) -> Motion:
    """Motion of a robot on its left foot; mirrored if the right one is that which stands.

    Args:
        angles: of the legs, and of the arms as far as they are known.
        robot: as ``problems.nao.body.nao`` makes it.

    Raises:
        InputError: a joint of the legs is missing, or times and angles are none.
    """
    missing = [name for name in JOINTS if name not in angles.joints]
    needed = [name for name in missing if name not in LEFT_OUT]
    if needed:
        raise InputError(f"{angles.owner} has no angles of {', '.join(needed)}")
    if len(angles.t) < LEAST_ROWS:
        raise InputError(f"{angles.owner} has {len(angles.t)} rows; a motion needs {LEAST_ROWS}")
    if not (np.isfinite(angles.t).all() and np.diff(angles.t).min() > 0.0):
        raise InputError(f"{angles.owner}: times must ascend")
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    for name in JOINTS:
        if name in columns and not np.isfinite(columns[name]).all():
            raise InputError(f"{angles.owner}: an angle of {name} is missing")
    q = np.column_stack([columns.get(name, np.full(len(angles.t), LEFT_OUT.get(name, 0.0))) for name in JOINTS])
    motion = Motion(robot=robot, t=angles.t - angles.t[0], q=q, held=tuple(missing))
    heights = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))[:, 2]
    return motion.mirror_image() if -heights.min() > max(heights.max(), LIFTED) else motion
