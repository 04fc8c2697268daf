"""NAO's double support phase: least mean power (Gupta, Pratihar, Deb 2023, sections 3.2 and 4.2).

The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
torso, which depends on where the hip is between the feet.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from casadi import DM, MX, SX, fmax, vertcat

from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import GaitProblem, Variable
from nlp_gait.problems.nao import (
    GRAVITY,
    HIP_VARIABLES,
    JOINTS,
    LEAST_DURATION,
    arm_joints,
    hip_motion,
    leg_joints,
    nao,
    upright_links,
)
from nlp_gait.problems.nao_limits import phase_problem
from nlp_gait.problems.nao_phase import Derivatives, Loader, Loads, Phase, Plan, Planner
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import combined_zmp, ground_load, zmp_of_wrench
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant, stack

# Section 4.2 and Table 5 [m].
SOLES_XY = {"L": (0.06, 0.05), "R": (0.12, -0.05)}
HIP_X, HIP_Y = (0.07, 0.11), (0.025, -0.025)
MEAN_DBM = (0.08, 0.08)
ARM_SWING = {  # Table 5, rows 4 to 7 [rad]
    "LShoulderPitch": (1.0, 1.5),
    "LElbowRoll": (-0.64, -0.50),
    "RShoulderPitch": (2.0, 1.5),
    "RElbowRoll": (0.42, 0.50),
}
FEET = {"L": "left", "R": "right"}

VARIABLES = (
    *HIP_VARIABLES,
    Variable(name="double_support_time_s", unit="s", lower=0.2, upper=2.0, description="x8"),
)

TorsoShare = Literal["printed", "lever"]


def nao_dsp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    samples_per_interval: int = 1,
) -> GaitProblem:
    """Double support of NAO.

    Args:
        robot: name or file of the robot.
        intervals: equal parts of the phase over which torques may change by the limit.
        derivatives: analytic, or finite differences of the sampled angles as in the paper.
        rotational_inertia: False takes every link as a point mass, in torques and ZMP.
        torso_share: how the torso's mass is shared between the legs (see ``torso_shares``).
        samples_per_interval: above 1 for a grid that is denser than the intervals.
    """
    if torso_share not in get_args(TorsoShare):
        raise InputError(f"torso_share must be one of {', '.join(get_args(TorsoShare))}, got {torso_share!r}")
    model = nao(robot, rotational_inertia)
    return phase_problem(
        name="nao-dsp",
        title="NAO, double support: least mean power",
        variables=VARIABLES,
        phase=Phase(
            robot=model,
            variables=len(VARIABLES),
            duration="double_support_time_s",
            plan=_planner(model),
            loads=_loads(model, torso_share),
            intervals=intervals,
            samples_per_interval=samples_per_interval,
            derivatives=derivatives,
        ),
        margins=lambda zmp, ops: double_support_margins(zmp, model, ops),
        mean_dbm_m=MEAN_DBM,
        make=nao_dsp,
        options={
            "robot": robot,
            "intervals": intervals,
            "derivatives": derivatives,
            "rotational_inertia": rotational_inertia,
            "torso_share": torso_share,
        },
    )


def _planner(robot: Robot) -> Planner:
    """Motion of hip and arms over standing feet (Table 5), and of the joints by inverse kinematics."""
    ankles = {
        side: stack(*map(constant, (*xy, robot.feet[FEET[side]].ankle_height_m))) for side, xy in SOLES_XY.items()
    }

    def plan(x: SX, margin: SX, phase: SX, ops: Nonsmooth) -> Plan:
        duration = fmax(x[7], LEAST_DURATION)
        hip = hip_motion(x[:7], HIP_X, HIP_Y, duration, phase)
        left, left_reach = leg_joints(robot, "L", hip, ankles["L"], margin, ops)
        right, right_reach = leg_joints(robot, "R", hip, ankles["R"], margin, ops)
        return Plan(
            joints={**left, **right, **arm_joints(ARM_SWING, duration, phase)},
            hip=hip.position,
            ankles={side: ankle.position for side, ankle in ankles.items()},
            reach=vertcat(left_reach, right_reach),
        )

    return plan


def torso_shares(hip_y: SX, rule: TorsoShare) -> dict[str, SX]:
    """Share of the torso's mass that each leg carries, from the hip's distances to the feet; both add up to 1.

    With signed distances, so that a hip beyond a foot gives a share beyond 0 and 1 and no kink.

    Args:
        hip_y: position of the hip across the walking direction [m].
        rule: ``"printed"`` is proportional to the distance *from* that leg's own foot, as in the equations; ``"lever"`` to
            the distance from the other foot, as the text says: the nearer foot carries more.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (28), (29).
    """
    from_left, from_right = SOLES_XY["L"][1] - hip_y, hip_y - SOLES_XY["R"][1]
    width = SOLES_XY["L"][1] - SOLES_XY["R"][1]
    left, right = from_left / width, from_right / width  # (eqs. 28, 29)
    return {"L": left, "R": right} if rule == "printed" else {"L": right, "R": left}


def _loads(robot: Robot, rule: TorsoShare) -> Loader:
    """Torques of each half from its own foot, and the combined ZMP of both feet."""
    halves = {
        side: tree_from(robot, robot.feet[foot].link, [joint for joint in JOINTS if joint.startswith(side)])
        for side, foot in FEET.items()
    }
    weight, upright = robot.mass_kg * GRAVITY, upright_links(robot)

    def loads(joints: Mapping[str, Motion], hip: SX) -> Loads:
        q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
        shares = torso_shares(hip[1], rule)
        torques: dict[str, SX] = {}
        zmps, ground_loads = [], []
        for side, tree in halves.items():
            half, wrench = newton_euler(tree, q, qd, qdd, GRAVITY, {robot.root: shares[side]}, upright)
            offset = zmp_of_wrench(wrench, robot.feet[FEET[side]].ankle_height_m, weight)
            torques |= half
            zmps.append(DM(SOLES_XY[side]) + offset)
            ground_loads.append(ground_load(wrench, weight))
        return Loads(torques, combined_zmp(zmps, ground_loads))

    return loads


def double_support_margins(zmp: MX, robot: Robot, ops: Nonsmooth) -> tuple[MX, MX]:
    """Balance margins in x and y, (1, N + 1) each [m]: distances to the sides of the box around both soles.

    Source:
        Gupta, Pratihar, Deb (2023), Fig. 8 (b).
    """
    feet = {side: robot.feet[foot] for side, foot in FEET.items()}
    back = min(SOLES_XY[side][0] - foot.back_m for side, foot in feet.items())
    front = max(SOLES_XY[side][0] + foot.front_m for side, foot in feet.items())
    right = min(SOLES_XY[side][1] - foot.right_m for side, foot in feet.items())
    left = max(SOLES_XY[side][1] + foot.left_m for side, foot in feet.items())
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(front - x, x - back).T, ops.min(left - y, y - right).T
