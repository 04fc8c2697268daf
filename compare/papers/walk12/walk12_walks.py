"""Gaits of the 12-joint walk in MuJoCo: two step times, seven drives, and starts whose joints are slightly off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import count, product
from typing import Any

import numpy as np

from compare.papers.walk12.walk12_paper import MOTOR_TORQUE_NM, SET_POINTS
from compare.study.task import ProblemSpec
from nlp_gait.formulation import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure_walk
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import OnStep, simulate_plan

ROBOT_STEP_S = 1.2  # of the experiments, section 7
STEP_TIMES_S = (1.0, ROBOT_STEP_S)
WALKED_STEPS = 10
PERTURBATION_RAD = 0.01  # standard deviation of the joint angles at a perturbed start
HELD = "as printed: 1.02 Nm, 10 set-points held, nothing added"
# Whether the motors' torque and the number of set-points are as printed, what is added to a set-point, and what is between two.
DRIVES = {
    "ours": (False, False, "torque", "linear"),
    "1.02 Nm": (True, False, "torque", "linear"),
    "10 set-points": (False, True, "torque", "linear"),
    "1.02 Nm, 10 set-points": (True, True, "torque", "linear"),
    "1.02 Nm, 10 set-points, no feed-forward": (True, True, "none", "linear"),
    "10 set-points held, no feed-forward": (False, True, "none", "held"),
    HELD: (True, True, "none", "held"),
}


@dataclass(frozen=True, kw_only=True)
class WalkedGait:
    """A gait in the engine: until its fall [s], or the walked share of the planned distance of all steps."""

    weight: float
    by: str
    step_time_s: float
    drives: str  # one of ``DRIVES``
    steps: int
    fell_at_s: float | None
    walked_share: float | None
    starts: int  # perturbed ones
    upright: int  # of these, the walks without a fall


def simulate_walks(gait: tuple[float, str, Sequence[float]], starts: int) -> list[dict[str, Any]]:
    """Return the fields of ``WalkedGait`` for a gait by step time and drives; none without MuJoCo."""
    if find_spec("mujoco") is None:
        return []
    (weight, by, x), found = gait, []
    for step_time_s, (drives, (torque, set_points, added, between)) in product(STEP_TIMES_S, DRIVES.items()):
        problem = ProblemSpec(name="walk12").load().with_values(step_time_s=step_time_s)
        plan = make_plan(Result(problem=problem, x=problem.check_x(x)), WALKED_STEPS)
        period_s = step_time_s / SET_POINTS if between == "held" else Drive().period_s
        drive = Drive(feed_forward=added, interpolation=between, period_s=period_s)
        plan = _drive_as_printed(plan, torque, set_points)
        walk = measure_walk(plan, simulate_plan(plan, None, drive), drive, WALKED_STEPS)
        share = None if walk.walked_m is None else walk.walked_m / walk.planned_m
        ends = [simulate_plan(plan, None, drive, on_step=_perturb(seed)).fell_at_s for seed in range(starts)]
        known = {"weight": weight, "by": by, "step_time_s": step_time_s, "drives": drives, "starts": starts}
        known |= {"steps": walk.steps_done, "fell_at_s": walk.measurements.fell_at_s, "walked_share": share}
        found.append(known | {"upright": ends.count(None)})
    return found


def _perturb(seed: int) -> OnStep:
    """Return a function that moves all joints a little before the engine's first step."""
    steps = count()

    def move(model: Any, data: Any) -> None:
        if next(steps) == 0:
            joints = model.jnt_qposadr[1:]  # the first joint is the free one of the root
            data.qpos[joints] += np.random.default_rng(seed).normal(0.0, PERTURBATION_RAD, len(joints))

    return move


def _drive_as_printed(plan: Plan, torque: bool, set_points: bool) -> Plan:
    if torque:
        joints = {name: replace(joint, torque_limit_Nm=MOTOR_TORQUE_NM) for name, joint in plan.robot.joints.items()}
        plan = replace(plan, robot=replace(plan.robot, joints=joints))
    if set_points:
        every = (len(plan.signals.arrays["t"]) - 1) // (WALKED_STEPS * SET_POINTS)
        arrays = {name: array[::every] for name, array in plan.signals.arrays.items()}
        plan = replace(plan, signals=replace(plan.signals, arrays=arrays))
    return plan
