"""NAO as the textbook walks it, see ``biped.cart_table``; arms are held."""

from __future__ import annotations

from casadi import SX

from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.formulation.motion.signals import JointAngles
from nlp_gait.gaits.biped.cart_table.walker import Body, Footsteps
from nlp_gait.gaits.biped.recorded.cycle import Cycles
from nlp_gait.gaits.nao.body import GRAVITY, JOINTS, nao, upright_plan
from nlp_gait.gaits.nao.legs import leg_geometry
from nlp_gait.gaits.nao.problem import with_robot
from nlp_gait.gaits.nao.recorded.motion import LEFT_OUT, of_all_joints, stance_of
from nlp_gait.gaits.nao.recorded.problem import cycle_judge
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

    def dressed(problem: GaitProblem, repeats: bool) -> GaitProblem:
        return with_robot(problem, robot, model.armatures_kgm2, repeats=repeats)

    cycles = Cycles(
        judge=cycle_judge(model),
        stance=stance_of(model),
        intervals=intervals,
        options={"robot": robot, "intervals": intervals},
        dressed=dressed,
    )

    def judged(footsteps: Footsteps, t: Array, q: Array) -> Result:
        angles = JointAngles(owner="the cart-table walk", joints=LEGS, t=t, q=q)
        return cycles.judged(t, of_all_joints(angles), footsteps.single_s)

    return Body(
        feet=model.feet,
        ankles={side: (leg.hip_m[1], leg.ankle_height_m) for side, leg in legs.items()},
        joints=LEGS,
        legs=lambda hip, ankles: upright_plan(model, hip, ankles, {}, SX(LEAST_REACH_MARGIN), Exact()),
        hip_m=(0.0, 0.0, 0.0),
        gravity=GRAVITY,
        judged=judged,
    )
