"""A walking cycle by the textbook: the ZMP is planned first, and the centre of mass follows by preview control.

The robot is taken for a cart on a table: its mass moves at a constant height, and the table stands as long as the cart's ZMP lies
under its foot. No motion is optimised; the hip's height is the walker's to choose.

Source:
    Kajita and others (2003), see ``preview_control``; the second pass with the error of the whole body's ZMP is section 5 there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, finely_sampled
from nlp_gait.gaits.biped.cart_table.preview_control import PREVIEW_S, PreviewController
from nlp_gait.gaits.biped.instant import BOTH_FEET, PlannedInstant
from nlp_gait.gaits.biped.parts import CLOSURE_M
from nlp_gait.gaits.biped.single_support import swing_foot
from nlp_gait.robots import Foot
from nlp_gait.symbolic.trajectories import Motion, constant_motion, stack

SAMPLE_S = 0.005  # as in the source
SETTLING_S = 10.0  # after which the walk repeats


@dataclass(frozen=True, kw_only=True)
class Footsteps:
    """What a walk is planned from.

    Attributes:
        step_m: length from foot to foot [m].
        single_s: time of single support [s].
        double_s: time of double support [s].
        hip_height_m: of what the planned cycle calls the hip, constant [m].
        lift_m: highest point of the swing foot [m].
    """

    step_m: float
    single_s: float
    double_s: float
    hip_height_m: float
    lift_m: float

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
class Body:
    """What the textbook knows of a robot.

    Attributes:
        feet: ``"left"`` and ``"right"``.
        ankles: origins of the feet's links by side ``"L"``, ``"R"``, on the ground: across, and above it [m].
        joints: of the legs.
        legs: their angles under an upright torso, from the motions of the hip and of both ankles by side.
        hip_m: (3,) hip from the torso's origin [m].
        gravity: [m/s^2].
        judged: the cycle of footsteps whose legs have angles (T, J) at times (T,), judged as a planned one [s, rad].
    """

    feet: Mapping[str, Foot]
    ankles: Mapping[str, tuple[float, float]]
    joints: tuple[str, ...]
    legs: Callable[[Motion, Mapping[str, Motion]], PlannedInstant]
    hip_m: Sequence[float]
    gravity: float
    judged: Callable[[Footsteps, Array, Array], Result]


@dataclass(frozen=True, kw_only=True, eq=False)
class Walker:
    """A robot that walks by footsteps: from the hip's path over the floor to its joints.

    Attributes:
        body: the robot.
        footsteps: where and when.
    """

    body: Body
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
        left, right = (np.array(self._middle(side)) for side in BOTH_FEET)
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
        controller = PreviewController(sample_s=self.sample_s, height_m=height_m, gravity=self.body.gravity)
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

    def gait(self, hip_path: Callable[[Array], Array]) -> Result:
        """The cycle in which the hip moves along a path (2, k) over the floor, judged as a planned one.

        Raises:
            InputError: a foot is out of reach.
        """
        t, steps = self.times, self.footsteps
        hip = np.vstack([hip_path(t), np.full(len(t), steps.hip_height_m)])
        angles, reach, miss = (
            np.asarray(part.full().T) for part in self._legs.map(len(t))(np.minimum(t / steps.single_s, 1.0), hip)
        )
        for excess, what, remedy in (
            (reach - 1.0, "ankle is too far", "lower the hip, or shorten the step"),
            (miss - CLOSURE_M, "leg misses its foot", "choose another height of the hip"),
        ):
            if excess.size and excess.max() > 0.0:
                worst, leg = np.unravel_index(int(np.argmax(excess)), excess.shape)
                raise InputError(
                    f"a hip {steps.hip_height_m:g} m high reaches no step of {steps.step_m:g} m: at {t[worst]:.3f} s the "
                    f"{('left', 'right')[leg]} {what}; {remedy}"
                )
        return self.body.judged(steps, t, angles)

    @cached_property
    def _legs(self) -> ca.Function:
        """From the share of single support and the hip (3,) to the legs' angles, the cosines of both knees, and their misses."""
        share, hip, still = SX.sym("share"), SX.sym("hip", 3), SX(3, 1)
        (left_y, left_z), (right_y, right_z) = self.body.ankles["L"], self.body.ankles["R"]
        step = SX(self.footsteps.step_m)
        swing = swing_foot(-step, step, right_y, right_z, SX(self.footsteps.lift_m), SX(self.footsteps.single_s), share)
        feet = {"L": stack(*map(constant_motion, (0.0, left_y, left_z))), "R": swing}
        plan = self.body.legs(Motion(hip, still, still), feet)
        angles = ca.vertcat(*(plan.joints[name].position for name in self.body.joints))
        return ca.Function("legs", [share, hip], [angles, plan.reach, plan.miss])

    def _middle(self, side: str) -> tuple[float, float]:
        """Of the sole whose ankle stands at x = 0 [m]."""
        foot = self.body.feet[BOTH_FEET[side]]
        return (foot.front_m - foot.back_m) / 2, self.body.ankles[side][0] + (foot.left_m - foot.right_m) / 2


def cart_table_walk(body: Body, footsteps: Footsteps, *, passes: int = 2) -> Result:
    """A walking cycle from footsteps alone.

    Args:
        body: the robot.
        footsteps: with the hip's height.
        passes: 1 takes the robot for a cart; every further one moves the hip by what a cart needs to undo the distance of the
            whole body's ZMP from the planned one. The source has two.

    Raises:
        InputError: a foot is out of reach of the hip.
    """
    if isinstance(passes, bool) or not isinstance(passes, int) or passes < 1:
        raise InputError(f"passes must be a whole number >= 1, got {passes!r}")
    walker = Walker(body=body, footsteps=footsteps)
    planned = walker.planned_zmp
    # The robot whose hip is the cart says where its mass is; the cart is then moved there.
    hip = walker.followed(planned, footsteps.hip_height_m)
    first = finely_sampled(walker.gait(hip)).arrays
    mass = (first["com"] - first["hip"]).mean(axis=0) - np.array(body.hip_m)
    ahead, _, height = mass + (0.0, 0.0, footsteps.hip_height_m)
    cart = walker.followed(planned, height)
    corrections: list[Callable[[Array], Array]] = []

    def path(t: Array) -> Array:
        return sum((correction(t) for correction in corrections), cart(t) - np.array([[ahead], [0.0]]))

    gait = walker.gait(path)
    for _ in range(passes - 1):
        played = finely_sampled(gait).arrays

        def missed(t: Array, played: Mapping[str, Array] = played) -> Array:
            zmp = np.stack([np.interp(t, played["t"], played["zmp"][:, k]) for k in range(2)])
            return planned(t) - zmp

        corrections.append(walker.followed(missed, height, advances=False))
        gait = walker.gait(path)
    return gait
