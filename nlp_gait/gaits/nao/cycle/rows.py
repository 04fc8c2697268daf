"""Balance margins of NAO's walking cycle."""

from __future__ import annotations

import casadi as ca
from casadi import MX

from nlp_gait.formulation import Point
from nlp_gait.gaits.biped.cycle_motion import STEP
from nlp_gait.gaits.biped.double_support import Box, double_support_mean_margins, margins_in, support_box
from nlp_gait.gaits.biped.parts import Margins
from nlp_gait.gaits.biped.single_support import single_support_mean_margins
from nlp_gait.gaits.nao.legs import leg_geometry
from nlp_gait.gaits.nao.single_support import single_support_margins
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

PUBLISHED_STEP = 0.06  # [m]; the box around both soles, of which the least mean margins in double support are shares


def single_margins(robot: Robot) -> Margins:
    """On the left foot, which stands at zero below its own hip joint."""
    return single_support_margins((0.0, leg_geometry(robot, "L").hip_m[1]), robot.feet["left"])


def double_margins(robot: Robot) -> Margins:
    """In the box around the left foot and the right one a step ahead."""
    left, right = robot.feet["left"], robot.feet["right"]
    left_y, right_y = (leg_geometry(robot, side).hip_m[1] for side in "LR")

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        step = at[STEP]
        box = Box(
            back=ca.fmin(-left.back_m, step - right.back_m),
            front=ca.fmax(left.front_m, step + right.front_m),
            right=min(left_y - left.right_m, right_y - right.right_m),
            left=max(left_y + left.left_m, right_y + right.left_m),
        )
        return margins_in(box, zmp, ops)

    return margins


def mean_margins(robot: Robot) -> dict[str, tuple[float, float]]:
    """Default of the least mean margins of each phase in x and y [m]."""
    left, right = (leg_geometry(robot, side).hip_m[1] for side in "LR")
    box = support_box(robot, {"L": (0.0, left), "R": (PUBLISHED_STEP, right)})
    return {
        "ssp": single_support_mean_margins(robot.feet["left"]),
        "dsp": double_support_mean_margins(box),
    }
