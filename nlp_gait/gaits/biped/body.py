"""A biped as the gaits take it: everything in which one robot's phases differ from another's, and their usual variables."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Literal, Self, TypeAlias

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, InstantPoint, Parameter, Variable
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.curves import HIP_CURVES, Splines, Trajectory
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.limits import HEAT_LOSS, Box, Limit, Margins, compute_margins
from nlp_gait.gaits.biped.samples import BOTH_FEET, LEAST_DURATION, Instant
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import mirror_sign
from nlp_gait.symbolic.dynamics import tilt_gravity
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, cubic, stack

ZmpGravity = Literal["physical", "printed"]
ZmpMasses = Literal[25, 23]


class Support(StrEnum):
    """Kinds of phases, by the feet on the ground; the right foot swings."""

    SINGLE = "ssp"
    DOUBLE = "dsp"
    STAND = "stand"  # double support with both feet side by side

    @property
    def standing(self) -> tuple[str, ...]:
        """Sides of the feet on the ground."""
        return ("L",) if self is Support.SINGLE else ("L", "R")

    @property
    def words(self) -> str:
        """The kind in descriptions."""
        return "feet side by side" if self is Support.STAND else self.upper()


TIMES = {Support.SINGLE: "single_support_time_s", Support.DOUBLE: "double_support_time_s"}
LIFT = "swing_height_m"
STEEPEST_DEG = 30.0  # slope of the ground
TIMED_UNITS = ("s", "m/s", "rad/s")  # of variables whose bounds are this package's, not the robot's


def read_duration(point: InstantPoint, phase: Support) -> SX:
    """Return the duration of a phase [s], never zero."""
    return ca.fmax(point[TIMES[phase]], LEAST_DURATION)


# Angles that are planned besides the hip, by name [rad]: of swinging arms, or of a leaning torso; in a turn also the yaw of the
# torso and of the right foot, from the left one's.
Angles: TypeAlias = Mapping[str, Motion]
TORSO_YAW, RIGHT_YAW = "torso_yaw", "right_yaw"
LEAN = ("torso_roll", "torso_pitch")  # to either side, back and forward


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """An angle that a cycle plans besides the hip."""

    name: str  # of its variables
    rate: str  # name of its rate's variables
    bounds: tuple[float, float]  # of the angle [rad]
    largest_rate: float  # in both directions [rad/s]
    mirror_sign: float  # +1 or -1, its factor in a mirrored motion
    words: str  # description
    rate_words: str  # description of its rate


@dataclass(frozen=True, kw_only=True, eq=False)
class Body(ABC):
    """A biped whose gaits are planned."""

    family: str  # first part of the names of its problems
    title: str  # its name in titles
    full: Robot  # the robot with all its joints, as it is drawn
    simulated: Robot  # the robot of the engine, with links welded that never move
    robot: Robot  # likewise, as the dynamics take it: perhaps with point masses
    joints: tuple[str, ...]  # those whose torques and rates count
    planned: tuple[str, ...]  # those whose angles are limited
    mirrored: tuple[str, ...]  # of every joint on the other side
    # Joints of the left and the right half by ``"L"`` and ``"R"``; the root belongs to both
    leg_joints: Mapping[str, Sequence[str]]
    coordinates: tuple[Coordinate, ...]  # angles that a cycle plans besides the hip
    upright: frozenset[str]  # links that never turn
    gravity: float  # magnitude [m/s^2]
    feet_y: tuple[float, float]  # of the left and the right foot in all gaits, each below its own hip [m]
    leg_length_m: float  # from hip to ankle
    hip_height_m: tuple[float, float]  # least and greatest height of the hip
    # (3,) point that is called the hip, from the torso's origin [m]
    hip_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hip_name: str = "torso origin"  # of this point, in words
    step_length_m: float = 0.06  # default, from foot to foot
    heat: Parameter = HEAT_LOSS  # parameter K with the robot's default
    slope_rad: float = 0.0  # by which the ground rises forward; all places are in its axes
    closed_form: bool = True  # False if Newton's method computes the legs' angles
    drive_limits: bool = False  # whether torques and speeds are within the limits of the robot's file
    length_scale: float = 1.0  # lengths relative to NAO's
    time_scale: float = 1.0  # times and velocities relative to NAO's
    # Ratio of this robot's swing speed to that in NAO's papers, by which bounds on rates and times are scaled
    swing_speed: float = 1.0
    torque_scale: float = 1.0  # torques relative to NAO's
    # Joints of arms that the legs do not carry: each arm is a chain of its own on a torso at rest
    separate_joints: tuple[str, ...] = ()
    added_limits: AddedLimits = AddedLimits()  # of the user, for all gaits of this body
    # Whether the share of the torso that a leg carries in double support includes these arms
    carries_shared_arms: bool = False
    zmp_gravity: ZmpGravity = "physical"  # sign of g in the ZMP
    zmp_masses: ZmpMasses = 25  # point masses of a printed ZMP; by 23, neck and head are at the torso's centre of mass

    def tilt_ground(self, slope_deg: float) -> Self:
        """Return the robot on ground that rises forward by an angle; raises InputError beyond ``STEEPEST_DEG``."""
        if isinstance(slope_deg, bool) or not abs(slope_deg) <= STEEPEST_DEG:
            raise InputError(f"slope_deg must be within +-{STEEPEST_DEG:g}, got {slope_deg!r}")
        return replace(self, slope_rad=math.radians(slope_deg))

    def check_step_length(self, step_m: float) -> float:
        """Return a step length; 0 stands for NAO's in proportion [m]. Raises InputError unless it is finite and >= 0."""
        number = isinstance(step_m, (int, float)) and not isinstance(step_m, bool)
        if not (number and 0.0 <= step_m < math.inf):
            raise InputError(f"step_length_m must be a finite number > 0, or 0 for one in proportion, got {step_m!r}")
        return step_m if step_m > 0.0 else self.step_length_m

    @property
    def gravity_vector(self) -> tuple[float, float, float]:
        """Gravity (3,) in the axes of the ground [m/s^2]."""
        return tilt_gravity(self.gravity, self.slope_rad)

    @cached_property
    def mirror(self) -> tuple[list[int], Array]:
        """Columns and signs (J,) that exchange left and right in the angles or torques of all joints."""
        signs = [mirror_sign(self.robot, *pair) for pair in zip(self.joints, self.mirrored, strict=True)]
        return [self.joints.index(name) for name in self.mirrored], np.array(signs)

    @property
    def weight(self) -> float:
        """Of the whole robot [N]."""
        return self.robot.mass_kg * self.gravity

    def ankle(self, side: str) -> tuple[float, float]:
        """Return the place of an ankle above its foot ``"L"`` or ``"R"``: across the walking direction, and its height [m]."""
        return self.feet_y["LR".index(side)], self.robot.feet[BOTH_FEET[side]].ankle_height_m

    def standing_ankle(self, side: str, x: SX | float = 0.0, ground: SX | float = 0.0) -> Motion:
        """Return the motion (3,) of an ankle at rest, above a ground of this height [m]."""
        y, height = self.ankle(side)
        return stack(*map(constant_motion, (x, y, height + ground)))

    @property
    def support(self) -> tuple[float, float, float]:
        """(3,) left ankle where a motion begins at x = 0 [m]."""
        return (0.0, *self.ankle("L"))

    def scale_length(self, nao_m: float) -> float:
        """Scale a length of NAO's gaits, to a tenth of a millimetre [m]."""
        return round(nao_m * self.length_scale, 4)

    def scale_time(self, nao: float) -> float:
        """Scale a time or a velocity of NAO's gaits, so that Froude numbers are equal [s, m/s]."""
        return float(f"{nao * self.time_scale:.4g}")

    def round_place(self, x: float) -> float:
        """Round a place that follows from the step [m]."""
        return x

    def make_splines(self, phase: Support, trajectory: Trajectory) -> Splines:
        """Return the splines of a phase; a swing foot stays on its line across the walking direction."""
        units = dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(self.angle_names(phase), "rad")
        if phase == Support.SINGLE:
            units |= {"foot_x": "m", "foot_z": "m"}
        return Splines(trajectory=trajectory, units=units, length_scale=self.length_scale)

    @property
    def angle_variables(self) -> tuple[Variable, ...]:
        """Of the planned angles at both ends of a phase, where these are free."""
        return ()

    @abstractmethod
    def angle_names(self, phase: Support) -> tuple[str, ...]:
        """Return the names of the angles that a phase plans besides the hip."""

    @abstractmethod
    def angle_ends(self, phase: Support, point: InstantPoint) -> Mapping[str, tuple[SX, SX]]:
        """Return these angles at the start and the end of a phase [rad]."""

    def angles(self, phase: Support, point: InstantPoint, splines: Angles, duration: SX, s: SX) -> Angles:
        """Return the motion of these angles: cubics from rest to rest, and what ``splines`` add."""
        still = SX(0)
        return {
            name: add_motions(cubic(start, end, still, still, duration, s), splines[name])
            for name, (start, end) in self.angle_ends(phase, point).items()
        }

    @abstractmethod
    def cycle_angles(self, coordinates: Sequence[Motion]) -> Angles:
        """Return the planned angles of a cycle from its coordinates."""

    @abstractmethod
    def plan(self, hip: Motion, angles: Angles, ankles: Mapping[str, Motion], margin: SX, ops: Nonsmooth) -> Instant:
        """Return the motion of the whole robot: both legs between the torso and the feet.

        Motions are those of the hip (3,) [m], of the planned angles [rad], of which those left out rest, and of the ankles (3,)
        by ``"L"`` and ``"R"`` [m]; ``margin`` is on the reach of the knees.
        """

    def make_sole_margins(self, support_xy: tuple[float, float]) -> Margins:
        """Return the balance margins on the left sole, whose ankle is at ``support_xy`` [m]: distances to the nearer edges."""
        foot = self.robot.feet["left"]
        sole = Box(back=-foot.back_m, front=foot.front_m, right=-foot.right_m, left=foot.left_m)
        return lambda zmp, point, ops: compute_margins(sole, zmp - ca.repmat(DM(support_xy), 1, zmp.shape[1]), ops)

    @abstractmethod
    def check_footholds(self, footholds: Sequence[Foothold]) -> None:
        """Raise InputError if the robot cannot step along footholds, the right foot's first, for its build alone."""

    def make_curve_limits(self, phase: Support, count: int) -> tuple[Limit, ...]:
        """Return the limits that cubics cannot break but splines of ``count`` coefficients can; none without splines."""
        return ()


def make_hip_variables(body: Body) -> tuple[Variable, ...]:
    """Return hip height and velocities at both ends of a phase: the first variables of every phase (section 4)."""
    low, high = body.hip_height_m
    rows = [("hip_height_m", "m", low, high, f"height of the {body.hip_name} at both ends")]
    bounds = {"z": (-0.05, 0.05, "vertical"), "x": (0.001, 0.2, "sagittal"), "y": (-0.2, 0.2, "lateral")}
    for axis, (least, most, word) in bounds.items():
        for end in ("start", "end"):
            limits = body.scale_time(min(least, least * body.swing_speed)), body.scale_time(most * body.swing_speed)
            rows.append((f"hip_v{axis}_{end}_m_s", "m/s", *limits, f"{word} velocity at the {end}"))
    return make_variables(*rows)


def make_lift_variable(body: Body) -> Variable:
    """Return the height of the swing."""
    lower, upper = body.scale_length(0.015), body.scale_length(0.03)
    return Variable(name=LIFT, unit="m", lower=lower, upper=upper, description="highest point of the swing foot")


def make_time_variable(body: Body, phase: Support) -> Variable:
    """Return the duration of a phase."""
    least, most = {Support.SINGLE: (0.4, 4.0), Support.DOUBLE: (0.2, 2.0)}[phase]
    word = {Support.SINGLE: "from lift-off to touch-down", Support.DOUBLE: "from touch-down to the next lift-off"}[
        phase
    ]
    lower, upper = body.scale_time(least / body.swing_speed), body.scale_time(most)
    return Variable(name=TIMES[phase], unit="s", lower=lower, upper=upper, description=word)


def make_usual_bounds(body: Body, variable: Variable) -> Variable:
    """Return a variable with the bounds in proportion to NAO's, between which gaits start."""
    if variable.unit == "s":
        return replace(variable, lower=min(variable.lower * body.swing_speed, variable.upper))
    if variable.unit not in TIMED_UNITS:
        return variable
    lower = max(variable.lower, variable.lower / body.swing_speed)
    return replace(variable, lower=lower, upper=variable.upper / body.swing_speed)
