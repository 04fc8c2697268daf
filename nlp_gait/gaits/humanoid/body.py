"""A humanoid's body in a gait: what of its size goes into bounds and limits, and its motion under a torso that leans."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Parameter, Variable
from nlp_gait.gaits.biped.goals import HEAT_LOSS
from nlp_gait.gaits.biped.instant import BOTH_FEET, PlannedInstant
from nlp_gait.gaits.humanoid.newton import newton_steps
from nlp_gait.robots import load_robot
from nlp_gait.robots.biped import Biped, make_biped
from nlp_gait.symbolic.general_leg import TorsoMotion, leg_motion
from nlp_gait.symbolic.kinematics import axis_rotation
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

GRAVITY = 9.81  # [m/s^2]
# Heights of the hip's middle above the ankles, as shares of a leg's length. The least is the paper's; the greatest is more than
# its 0.886, with which ankles of other robots reach their limits.
HEIGHT_SHARES = (0.5905, 0.95)
# Lean of the torso: roll to either side, pitch back and forward [rad].
LARGEST_ROLL, LARGEST_PITCH = 0.15, 0.3
FORWARD, TO_THE_LEFT = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
STEP_M = 0.06  # NAO's, from foot to foot
LETTERS = {foot: letter for letter, foot in BOTH_FEET.items()}


@dataclass(frozen=True, kw_only=True, eq=False)
class Humanoid:
    """A biped with what its gaits need.

    Attributes:
        biped: its legs and size.
        steps: of Newton's method, by side.
    """

    biped: Biped
    steps: Mapping[str, int]

    @cached_property
    def middle_m(self) -> Array:
        """(3,) middle between the hips from the root's origin; the legs are mirror images."""
        x, _, z = self.biped.hip_middle_m
        return np.array([x, 0.0, z])

    def foot_y(self, side: str) -> float:
        """Where a foot stands across the walking direction: as at zero angles [m]."""
        return float(self.biped.legs[side].foot_m[1])

    @property
    def images(self) -> tuple[str, ...]:
        """Of every joint of the legs on the other side."""
        return tuple(self.biped.images[joint] for joint in self.biped.joints)

    @property
    def feet_y(self) -> tuple[float, float]:
        """Of the left and the right foot [m]."""
        return self.foot_y("left"), self.foot_y("right")

    def ankle_height(self, side: str) -> float:
        """Origin of a foot's link above its sole [m]."""
        return self.biped.model.feet[side].ankle_height_m

    @property
    def heat(self) -> Parameter:
        """K with the robot's default."""
        return replace(
            HEAT_LOSS,
            default=float(f"{self.biped.heat_W_per_Nm2:.4g}"),
            description=f"K, heat loss; {self.biped.heat_source}",
        )

    @property
    def upright_feet(self) -> frozenset[str]:
        """Links that keep the world's axes: flat soles."""
        return frozenset(foot.link for foot in self.biped.model.feet.values())

    def length(self, nao_m: float) -> float:
        """A length of NAO's gaits for this robot, to a tenth of a millimetre [m]."""
        return round(nao_m * self.biped.length_scale, 4)

    def velocity(self, nao_m_s: float) -> float:
        """A velocity, likewise [m/s]."""
        return float(f"{nao_m_s * self.biped.time_scale:.4g}")

    def time(self, nao_s: float) -> float:
        """A time, likewise [s]."""
        return float(f"{nao_s * self.biped.time_scale:.4g}")

    def step_length(self, asked_m: float) -> float:
        """Step length that an option asks for; 0 for NAO's in proportion [m].

        Raises:
            InputError: it is not a finite number >= 0.
        """
        number = isinstance(asked_m, (int, float)) and not isinstance(asked_m, bool)
        if not (number and 0.0 <= asked_m < math.inf):
            raise InputError(f"step_length_m must be a finite number > 0, or 0 for one in proportion, got {asked_m!r}")
        return asked_m if asked_m > 0.0 else round(STEP_M * self.biped.length_scale, 3)

    @property
    def hip_variables(self) -> tuple[Variable, ...]:
        """Height of the hips' middle and velocities at both ends of a phase."""
        leg = self.biped.legs["left"]
        above = self.ankle_height("left") + float(leg.ankle_m[2] - leg.foot_m[2])
        low, high = (round(above + share * leg.length_m, 3) for share in HEIGHT_SHARES)
        rows = [("hip_height_m", "m", low, high, "middle of both hips above the ground at both ends")]
        bounds = {"z": (-0.05, 0.05, "vertical"), "x": (0.001, 0.2, "sagittal"), "y": (-0.2, 0.2, "lateral")}
        for axis, (least, most, word) in bounds.items():
            for end in ("start", "end"):
                name = f"hip_v{axis}_{end}_m_s"
                rows.append((name, "m/s", self.velocity(least), self.velocity(most), f"{word} velocity, at the {end}"))
        return tuple(
            Variable(name=name, unit=unit, lower=lower, upper=upper, description=text)
            for name, unit, lower, upper, text in rows
        )

    def plan(
        self,
        hip: Motion,
        lean: tuple[Motion, Motion],
        ankles: Mapping[str, Motion],
        margin: SX,
        ops: Nonsmooth,
    ) -> PlannedInstant:
        """Motion of the whole robot: both legs between the torso and the feet.

        Args:
            hip: (3,) middle of both hips [m].
            lean: roll about the torso's own x axis, and its pitch before that [rad].
            ankles: (3,) origins of the feet's links by ``"L"`` and ``"R"`` [m].
            margin: on the reach of the knees.
            ops: interpretation.
        """
        roll, pitch = lean
        pitched, side = axis_rotation(TO_THE_LEFT, pitch.position), SX(DM(TO_THE_LEFT))
        rotation = pitched @ axis_rotation(FORWARD, roll.position)
        about = pitched @ DM(FORWARD)
        spin = side * pitch.velocity + about * roll.velocity
        rate = side * pitch.acceleration + about * roll.acceleration
        rate += ca.cross(side, about) * (pitch.velocity * roll.velocity)
        joints: dict[str, Motion] = {}
        reach, miss = [], []
        for letter, name in BOTH_FEET.items():
            leg = self.biped.legs[name]
            place = Motion(*(a - b for a, b in zip(hip, ankles[letter], strict=True)))
            torso = TorsoMotion(rotation, spin, rate, self.middle_m, place)
            found = leg_motion(leg, self.steps[name], torso, margin, ops, held=ops.exact)
            joints |= {joint: Motion(*(part[i] for part in found.joints)) for i, joint in enumerate(leg.joints)}
            reach.append(found.reach)
            miss.append(found.miss)
        half_roll, half_pitch = roll.position / 2, pitch.position / 2
        return PlannedInstant(
            joints=joints,
            hip=hip.position - rotation @ DM(self.middle_m),
            ankles={letter: ankle.position for letter, ankle in ankles.items()},
            reach=ca.vertcat(*reach),
            miss=ca.vertcat(*miss) if ops.exact else SX(0, 1),
            attitude=ca.vertcat(
                ca.cos(half_pitch) * ca.cos(half_roll),
                ca.cos(half_pitch) * ca.sin(half_roll),
                ca.sin(half_pitch) * ca.cos(half_roll),
                -ca.sin(half_pitch) * ca.sin(half_roll),
            ),
        )


def humanoid(robot: str) -> Humanoid:
    """Humanoid from a robot's name or file.

    Raises:
        InputError: its legs are not such as are solved; GaitError as ``load_robot``.
    """
    biped = make_biped(load_robot(robot))
    return Humanoid(biped=biped, steps={side: newton_steps(leg) for side, leg in biped.legs.items()})
