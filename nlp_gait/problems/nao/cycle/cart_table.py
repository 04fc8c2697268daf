"""A walking cycle by the textbook: the ZMP is planned first, and the centre of mass follows by preview control.

The robot is taken for a cart on a table: its mass moves at a constant height, and the table stands as long as the cart's ZMP lies
under its foot. No motion is optimised; the hip's height is the walker's to choose.

Source:
    Kajita and others (2003), see ``preview_control``; the second pass with the error of the whole body's ZMP is section 5 there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import InputError
from nlp_gait.problem import Array, Result, finely_sampled
from nlp_gait.problems.biped.single_support import swing_foot
from nlp_gait.problems.nao.body import JOINTS, nao, upright_plan
from nlp_gait.problems.nao.cycle.preview_control import PREVIEW_S, PreviewController
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.problems.nao.recorded.motion import LEFT_OUT, JointAngles
from nlp_gait.problems.nao.recorded.problem import Recorded, recorded
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact
from nlp_gait.symbolic.trajectories import Motion, constant, stack

SAMPLE_S = 0.005  # as in the source
SETTLING_S = 10.0  # after which the walk repeats
LEGS = tuple(name for name in JOINTS if name not in LEFT_OUT)  # arms are held


@dataclass(frozen=True, kw_only=True)
class Footsteps:
    """What a walk is planned from.

    Attributes:
        step_m: length from foot to foot [m].
        single_s: time of single support [s].
        double_s: time of double support [s].
        hip_height_m: of the torso's origin, constant [m].
        lift_m: highest point of the swing foot [m].
    """

    step_m: float
    single_s: float
    double_s: float
    hip_height_m: float
    lift_m: float = 0.015

    def __post_init__(self) -> None:
        """Refuse what is no walk."""
        for name, value in vars(self).items():
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} must be a finite number > 0, got {value!r}")

    @property
    def period_s(self) -> float:
        """Of one step [s]."""
        return self.single_s + self.double_s


@dataclass(frozen=True, kw_only=True, eq=False)
class Walker:
    """A robot that walks by footsteps: from the hip's path over the floor to its joints.

    Attributes:
        robot: as ``problems.nao.body.nao`` makes it.
        footsteps: where and when.
    """

    robot: Robot
    footsteps: Footsteps

    @property
    def sample_s(self) -> float:
        """Of the controller: about ``SAMPLE_S``, and a step is a whole number of them [s]."""
        return self.footsteps.period_s / math.ceil(self.footsteps.period_s / SAMPLE_S)

    @property
    def shown(self) -> int:
        """Step that is the cycle: the first on the left foot after settling."""
        return 2 * math.ceil(SETTLING_S / self.footsteps.period_s / 2)

    @property
    def times(self) -> Array:
        """Of the cycle: about ``SAMPLE_S`` apart in each phase, with both switches among them [s]."""
        single, double = self.footsteps.single_s, self.footsteps.double_s
        first, second = (math.ceil(duration / SAMPLE_S) + 1 for duration in (single, double))
        return np.concatenate([np.linspace(0.0, single, first), np.linspace(single, single + double, second)[1:]])

    @property
    def planned_zmp(self) -> Callable[[Array], Array]:
        """ZMP (2, k) in the cycle at times (k,): under the middle of the supporting sole, then straight to the next one [m]."""
        left, right = (np.array(self._middle(side, name)) for side, name in (("L", "left"), ("R", "right")))
        ahead = right + (self.footsteps.step_m, 0.0)

        def zmp(t: Array) -> Array:
            share = np.clip((t - self.footsteps.single_s) / self.footsteps.double_s, 0.0, 1.0)
            return np.asarray(left[:, None] + share * (ahead - left)[:, None])

        return zmp

    def followed(
        self, zmp: Callable[[Array], Array], height_m: float, *, advances: bool = True
    ) -> Callable[[Array], Array]:
        """Path (2, k) of the cart's mass in the cycle whose ZMP follows one that repeats, mirrored from step to step [m].

        Args:
            zmp: (2, k) of a cycle at times (k,) [m].
            height_m: of the mass.
            advances: every step leads a step further; False for a correction.
        """
        controller = PreviewController(sample_s=self.sample_s, height_m=height_m)
        period, begins = self.footsteps.period_s, self.shown * self.footsteps.period_s
        t = np.arange(math.ceil((begins + period + PREVIEW_S) / self.sample_s) + 2) * self.sample_s
        step = np.floor(t / period + 1e-9)
        x, y = zmp(t - step * period)
        way = self.footsteps.step_m * advances
        courses = [controller.follow(x + step * way), controller.follow(np.where(step % 2 == 0, y, -y))]

        def path(t: Array) -> Array:
            along, across = (course.at(begins + t) for course in courses)
            return np.stack([along - self.shown * way, across])

        return path

    def gait(self, hip_path: Callable[[Array], Array], robot: str, intervals: int) -> Recorded:
        """The cycle in which the hip moves along a path (2, k) over the floor, judged by the limits of ``nao-cycle``.

        Raises:
            InputError: a foot is out of reach.
        """
        t, steps = self.times, self.footsteps
        hip = np.vstack([hip_path(t), np.full(len(t), steps.hip_height_m)])
        angles, reach = (
            np.asarray(part.full().T) for part in self._legs.map(len(t))(np.minimum(t / steps.single_s, 1.0), hip)
        )
        worst = int(np.argmax(reach.max(axis=1)))
        if reach[worst].max() > 1.0:
            raise InputError(
                f"a hip {steps.hip_height_m:g} m high reaches no step of {steps.step_m:g} m: at {t[worst]:.3f} s the "
                f"{('left', 'right')[int(np.argmax(reach[worst]))]} ankle is too far; lower the hip, or shorten the step"
            )
        walk = JointAngles(owner="the cart-table walk", joints=LEGS, t=t, q=angles)
        return recorded(walk, robot=robot, intervals=intervals, gait="nao-cycle", touch_down_s=steps.single_s)

    @cached_property
    def _legs(self) -> ca.Function:
        """From the share of single support and the hip (3,) to the legs' angles, and the cosines of both knees."""
        share, hip, still = SX.sym("share"), SX.sym("hip", 3), SX(3, 1)
        (left_y, left_z), (right_y, right_z) = self._ankle("L"), self._ankle("R")
        step = SX(self.footsteps.step_m)
        swing = swing_foot(-step, step, right_y, right_z, SX(self.footsteps.lift_m), SX(self.footsteps.single_s), share)
        feet = {"L": stack(*map(constant, (0.0, left_y, left_z))), "R": swing}
        plan = upright_plan(self.robot, Motion(hip, still, still), feet, {}, SX(LEAST_REACH_MARGIN), Exact())
        return ca.Function(
            "legs", [share, hip], [ca.vertcat(*(plan.joints[name].position for name in LEGS)), plan.reach]
        )

    def _ankle(self, side: str) -> tuple[float, float]:
        """Of an ankle on the ground below its own hip joint: across, and above the ground [m]."""
        geometry = leg_geometry(self.robot, side)
        return geometry.hip_m[1], geometry.ankle_height_m

    def _middle(self, side: str, name: str) -> tuple[float, float]:
        """Of the sole whose ankle stands at x = 0 [m]."""
        foot = self.robot.feet[name]
        return (foot.front_m - foot.back_m) / 2, self._ankle(side)[0] + (foot.left_m - foot.right_m) / 2


def cart_table_walk(footsteps: Footsteps, *, robot: str = "nao-v5", intervals: int = 10, passes: int = 2) -> Recorded:
    """A walking cycle from footsteps alone, judged by the limits of ``nao-cycle``.

    Args:
        footsteps: with the hip's height.
        robot: name or file.
        intervals: of each phase, as in the planned problem.
        passes: 1 takes the robot for a cart; every further one moves the hip by what a cart needs to undo the distance of the
            whole body's ZMP from the planned one. The source has two.

    Raises:
        InputError: a foot is out of reach of the hip, or the robot has other legs.
    """
    if isinstance(passes, bool) or not isinstance(passes, int) or passes < 1:
        raise InputError(f"passes must be a whole number >= 1, got {passes!r}")
    walker = Walker(robot=nao(robot, rotational_inertia=True), footsteps=footsteps)
    planned = walker.planned_zmp
    # The robot whose hip is the cart says where its mass is; the cart is then moved there.
    hip = walker.followed(planned, footsteps.hip_height_m)
    first = _played(walker.gait(hip, robot, intervals))
    ahead, _, height = (first["com"] - first["hip"]).mean(axis=0) + (0.0, 0.0, footsteps.hip_height_m)
    cart = walker.followed(planned, height)
    corrections: list[Callable[[Array], Array]] = []

    def path(t: Array) -> Array:
        return sum((correction(t) for correction in corrections), cart(t) - np.array([[ahead], [0.0]]))

    gait = walker.gait(path, robot, intervals)
    for _ in range(passes - 1):
        played = _played(gait)

        def missed(t: Array, played: dict[str, Array] = played) -> Array:
            zmp = np.stack([np.interp(t, played["t"], played["zmp"][:, k]) for k in range(2)])
            return planned(t) - zmp

        corrections.append(walker.followed(missed, height, advances=False))
        gait = walker.gait(path, robot, intervals)
    return gait


def _played(gait: Recorded) -> dict[str, Array]:
    """Time histories of a gait."""
    return dict(finely_sampled(Result(problem=gait.problem, x=np.array(gait.x))).arrays)
