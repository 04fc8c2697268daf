"""Double support of NAO: where the feet stand, and the hip's motion between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from casadi import DM, SX, fmax

from nlp_gait.problem.gait_problem import Variable
from nlp_gait.problems.nao.body import LEAST_DURATION
from nlp_gait.problems.nao.curves import hip_on_spline
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.robots import Robot
from nlp_gait.symbolic.trajectories import Motion

DURATION = Variable(name="double_support_time_s", unit="s", lower=0.2, upper=2.0, description="x8")

Point2: TypeAlias = tuple[float, float]


def soles_of(robot: Robot, step: float) -> dict[str, Point2]:
    """Ankles on the ground: the right foot a step ahead, each below its own hip joint (section 4.2)."""
    return {"L": (step, leg_geometry(robot, "L").hip_m[1]), "R": (2 * step, leg_geometry(robot, "R").hip_m[1])}


def standing_ankles(robot: Robot, soles: Mapping[str, Point2]) -> dict[str, SX]:
    """Ankles (3,) by side, above where the feet stand [m]."""
    return {side: SX(DM([*xy, leg_geometry(robot, side).ankle_height_m])) for side, xy in soles.items()}


def double_support_duration(x: SX) -> SX:
    """Time of the phase [s] from x (n,), never zero."""
    return fmax(x[7], LEAST_DURATION)


def double_support_hip(x: SX, more: Mapping[str, Motion], soles: Mapping[str, Point2], phase: SX) -> Motion:
    """Motion of the torso's origin (3,) between standing feet [m] (Table 5, rows 1 to 3), and what each curve adds.

    The hip moves from a sixth of a step ahead of the rear foot to a sixth behind the front one, rounded to a micrometre so
    that the paper's numbers come out exactly, and from halfway to the left foot to halfway to the right one.
    """
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6
    hip_x, hip_y = (round(rear_x + sixth, 6), round(front_x - sixth, 6)), (left_y / 2, right_y / 2)
    return hip_on_spline(x, more, hip_x, hip_y, double_support_duration(x), phase)
