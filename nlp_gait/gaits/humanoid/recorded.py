"""A humanoid's cycle that is given as angles over time, judged by the limits of ``humanoid-cycle``."""

from __future__ import annotations

from functools import partial

import casadi as ca
from casadi import MX, SX

from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.recorded.cycle import Cycles, Half, Judge
from nlp_gait.gaits.biped.recorded.stance import Stance
from nlp_gait.gaits.biped.single_support import loads_on_left
from nlp_gait.gaits.humanoid.body import GRAVITY, Humanoid
from nlp_gait.gaits.humanoid.cycle import (
    cycle_margins,
    double_support_planner,
    humanoid_cycle_of,
    humanoid_cycle_variables,
    single_support_planner,
)
from nlp_gait.gaits.humanoid.double_support import standing
from nlp_gait.gaits.humanoid.problem import parts_of, with_body
from nlp_gait.robots.leg import LEG_JOINT_COUNT
from nlp_gait.symbolic.general_leg import compute_reach


def recorded_cycles(body: Humanoid, *, robot: str, intervals: int, drive_limits: bool) -> Cycles:
    """Judge of cycles whose torso is upright; their joints are those of the left leg, then of the right one.

    Args:
        body: the humanoid.
        robot: its name or file.
        intervals: of each phase, as in the planned problem.
        drive_limits: whether torques and speeds must be within what the robot's file says.
    """
    model = body.biped.model
    stance = Stance(
        robot=model,
        joints=body.biped.joints,
        images=body.images,
        support=(0.0, body.foot_y("left"), body.ankle_height("left")),
        hip_m=tuple(body.middle_m.tolist()),
    )

    def dressed(problem: GaitProblem, repeats: bool) -> GaitProblem:
        return with_body(problem, body, model.armatures_kgm2, repeats=repeats)

    return Cycles(
        judge=_judge(body, drive_limits),
        stance=stance,
        intervals=intervals,
        options={"robot": robot, "intervals": intervals, "drive_limits": drive_limits},
        dressed=dressed,
    )


def _judge(body: Humanoid, drive_limits: bool) -> Judge:
    """The planned cycle as the judge."""
    model, margins = body.biped.model, cycle_margins(body)
    loads = {"ssp": loads_on_left(model, GRAVITY, ()), "dsp": standing(body, model, ()).loads("lever")}
    plans = {"ssp": single_support_planner(body), "dsp": double_support_planner(body)}
    halves = {
        name: Half(
            plan=plans[name],
            loads=loads[name],
            parts=parts_of(body, *margins[name], drive_limits=drive_limits, solved=False),
        )
        for name in plans
    }
    return Judge(
        owner=body.biped.full.name,
        robot=model,
        joints=body.biped.joints,
        planned=body.biped.joints,
        variables=humanoid_cycle_variables(body),
        halves=halves,
        goal=Goal(heat=body.heat),
        cosines=partial(_cosines, body),
        joined=partial(humanoid_cycle_of, body, model, at_given_speed=False),
    )


def _cosines(body: Humanoid, q: MX) -> MX:
    """Of both knees (2, N + 1), from all angles (12, N + 1)."""
    angles = SX.sym("q", len(body.biped.joints))
    legs = zip(body.biped.legs.values(), ca.vertsplit(angles, LEG_JOINT_COUNT), strict=True)
    reach = ca.Function("reach", [angles], [ca.vertcat(*(compute_reach(leg, own) for leg, own in legs))])
    return reach.map(q.shape[1])(q)
