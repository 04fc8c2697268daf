"""A humanoid as the textbook walks it, see ``biped.cart_table``: its own legs under an upright torso."""

from __future__ import annotations

from casadi import SX

from nlp_gait.formulation import Array, Result
from nlp_gait.gaits.biped.cart_table.walker import Body, Footsteps
from nlp_gait.gaits.humanoid.body import GRAVITY, LETTERS, humanoid
from nlp_gait.gaits.humanoid.recorded import recorded_cycles
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact
from nlp_gait.symbolic.trajectories import constant_motion


def humanoid_on_a_table(robot: str = "nao-v5", intervals: int = 10, drive_limits: bool = True) -> Body:
    """A humanoid whose walks are judged by the limits of ``humanoid-cycle``; its hip is the middle of both hips.

    Args:
        robot: name or file.
        intervals: of each phase, as in the planned problem.
        drive_limits: whether torques and speeds must be within what the robot's file says.

    Raises:
        GaitError: as ``humanoid``.
    """
    body, upright = humanoid(robot), (constant_motion(0.0), constant_motion(0.0))
    cycles = recorded_cycles(body, robot=robot, intervals=intervals, drive_limits=drive_limits)

    def judged(footsteps: Footsteps, t: Array, q: Array) -> Result:
        return cycles.judged(t, q, footsteps.single_s)

    return Body(
        feet=body.biped.model.feet,
        ankles={letter: (body.foot_y(side), body.ankle_height(side)) for side, letter in LETTERS.items()},
        joints=body.biped.joints,
        legs=lambda hip, ankles: body.plan(hip, upright, ankles, SX(LEAST_REACH_MARGIN), Exact()),
        hip_m=tuple(body.middle_m.tolist()),
        gravity=GRAVITY,
        judged=judged,
    )
