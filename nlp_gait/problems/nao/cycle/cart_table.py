"""NAO as the textbook walks it, see ``biped.cart_table``; arms are held."""

from __future__ import annotations

import numpy as np
from casadi import SX

from nlp_gait.problem import Array, Result
from nlp_gait.problems.biped.cart_table.walker import Body, Footsteps
from nlp_gait.problems.nao.body import GRAVITY, JOINTS, nao, upright_plan
from nlp_gait.problems.nao.legs import leg_geometry
from nlp_gait.problems.nao.recorded.motion import LEFT_OUT, JointAngles
from nlp_gait.problems.nao.recorded.problem import recorded
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact

LEGS = tuple(name for name in JOINTS if name not in LEFT_OUT)


def nao_on_a_table(robot: str = "nao-v5", intervals: int = 10) -> Body:
    """NAO, whose walks are judged by the limits of ``nao-cycle``; its hip is the torso's origin.

    Args:
        robot: name or file.
        intervals: of each phase, as in the planned problem.

    Raises:
        InputError: the robot has other legs.
    """
    model = nao(robot, rotational_inertia=True)
    legs = {side: leg_geometry(model, side) for side in "LR"}

    def judged(footsteps: Footsteps, t: Array, q: Array) -> Result:
        walk = JointAngles(owner="the cart-table walk", joints=LEGS, t=t, q=q)
        gait = recorded(walk, robot=robot, intervals=intervals, gait="nao-cycle", touch_down_s=footsteps.single_s)
        return Result(problem=gait.problem, x=np.array(gait.x))

    return Body(
        feet=model.feet,
        ankles={side: (leg.hip_m[1], leg.ankle_height_m) for side, leg in legs.items()},
        joints=LEGS,
        legs=lambda hip, ankles: upright_plan(model, hip, ankles, {}, SX(LEAST_REACH_MARGIN), Exact()),
        hip_m=(0.0, 0.0, 0.0),
        gravity=GRAVITY,
        judged=judged,
    )
