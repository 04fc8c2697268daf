"""NAO's double support phase: least mean power (Gupta, Pratihar, Deb 2023, sections 3.2 and 4.2).

The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
torso, which depends on where the hip is between the feet.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Generic, Literal, NamedTuple, TypeVar, get_args

from casadi import MX, SX, vertcat

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import GaitProblem
from nlp_gait.problems.nao.body import (
    GRAVITY,
    JOINTS,
    leg_joints,
    nao,
    upright_links,
)
from nlp_gait.problems.nao.curve_limits import Criterion, with_motion
from nlp_gait.problems.nao.curves import (
    Splines,
    Trajectory,
    arm_motions,
    hip_and_arm_units,
    motion_options,
    samples_in_interval,
)
from nlp_gait.problems.nao.double_support_stance import (
    DURATION,
    Point2,
    double_support_duration,
    double_support_hip,
    soles_of,
    standing_ankles,
)
from nlp_gait.problems.nao.legs import check_step_length, hip_variables, leg_geometry
from nlp_gait.problems.nao.limits import phase_problem
from nlp_gait.problems.nao.motors import motor_options, with_motors
from nlp_gait.problems.nao.phase import Derivatives, Loader, Loads, Phase, Plan, Planner
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import combined_zmp, ground_load, zmp_of_wrench
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

# Section 4.2: least mean margins of 0.08 m, in the box of 0.21 m by 0.18 m around NAO's soles.
MEAN_DBM_SHARES = (8 / 21, 4 / 9)
ARM_SWING = {  # Table 5, rows 4 to 7 [rad]
    "LShoulderPitch": (1.0, 1.5),
    "LElbowRoll": (-0.64, -0.50),
    "RShoulderPitch": (2.0, 1.5),
    "RElbowRoll": (0.42, 0.50),
}
FEET = {"L": "left", "R": "right"}

TorsoShare = Literal["printed", "lever"]
Side = TypeVar("Side", float, MX)


def nao_dsp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    step_length_m: float = 0.06,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
) -> GaitProblem:
    """Double support of NAO.

    Args:
        robot: name or file of the robot.
        intervals: equal parts of the phase over which torques may change by the limit.
        derivatives: analytic, or finite differences of the sampled angles as in the paper.
        rotational_inertia: False takes every link as a point mass, in torques and ZMP.
        torso_share: how the torso's mass is shared between the legs (see ``torso_shares``).
        step_length_m: from foot to foot.
        samples_per_interval: above 1 for a grid that is denser than the intervals; 0 for what suits the trajectory: 1 with
            cubics, 4 with splines, which would else bend between the samples.
        trajectory: of hip and arms: the paper's cubics, or more coefficients on top of them.
        objective: what is minimised: power as in the paper, joint jerk, or the rate of torques.
        motors: what of the real motors is taken into account, separated by commas, see ``nao_motors``; nothing by default.
    """
    if torso_share not in get_args(TorsoShare):
        raise InputError(f"torso_share must be one of {', '.join(get_args(TorsoShare))}, got {torso_share!r}")
    check_step_length(step_length_m)
    model = nao(robot, rotational_inertia)
    soles = soles_of(model, step_length_m)
    box = support_box(model, soles)
    own = (*hip_variables(model), DURATION)
    splines = Splines(trajectory=trajectory, units=hip_and_arm_units(ARM_SWING), first=len(own))
    variables = (*own, *splines.variables)
    samples = samples_in_interval(trajectory, samples_per_interval)
    phase = Phase(
        robot=model,
        variables=len(variables),
        duration=DURATION.name,
        plan=_planner(model, soles, splines),
        loads=double_support_loads(model, torso_share),
        intervals=intervals,
        samples_per_interval=samples,
        derivatives=derivatives,
    )
    problem = phase_problem(
        name="nao-dsp",
        title="NAO, double support: least mean power",
        variables=variables,
        phase=phase,
        margins=lambda zmp, ops: double_support_margins(zmp, box, ops),
        mean_dbm_m=double_support_mean_margins(box),
        make=nao_dsp,
        options={
            "robot": robot,
            "intervals": intervals,
            "derivatives": derivatives,
            "rotational_inertia": rotational_inertia,
            "torso_share": torso_share,
            "step_length_m": step_length_m,
            **motion_options(trajectory, objective, samples),
            **motor_options(motors),
        },
    )

    def arms(x: SX, s: SX) -> Mapping[str, Motion]:
        duration = double_support_duration(x)
        return arm_motions(splines.motions(x, duration, s), ARM_SWING, duration, s)

    return with_motors(with_motion(problem, phase, splines, objective, arms), phase, motors)


class Box(NamedTuple, Generic[Side]):
    """Sides of the rectangle around both soles [m]."""

    back: Side
    front: Side
    right: float
    left: float


def support_box(robot: Robot, soles: Mapping[str, Point2]) -> Box[float]:
    """Rectangle around both soles, whose ankles stand at ``soles`` by side."""
    feet = {side: robot.feet[foot] for side, foot in FEET.items()}
    return Box(
        back=min(soles[side][0] - foot.back_m for side, foot in feet.items()),
        front=max(soles[side][0] + foot.front_m for side, foot in feet.items()),
        right=min(soles[side][1] - foot.right_m for side, foot in feet.items()),
        left=max(soles[side][1] + foot.left_m for side, foot in feet.items()),
    )


def double_support_mean_margins(box: Box[float]) -> Point2:
    """Least mean balance margins in x and y as shares of the box, to a tenth of a millimetre [m]."""
    along, across = MEAN_DBM_SHARES
    return round(along * (box.front - box.back), 4), round(across * (box.left - box.right), 4)


def _planner(robot: Robot, soles: Mapping[str, Point2], splines: Splines) -> Planner:
    """Motion of hip and arms over standing feet (Table 5), and of the joints by inverse kinematics."""
    ankles = standing_ankles(robot, soles)

    def plan(x: SX, margin: SX, phase: SX, ops: Nonsmooth) -> Plan:
        duration = double_support_duration(x)
        more = splines.motions(x, duration, phase)
        hip = double_support_hip(x, more, soles, phase)
        still = {side: Motion(ankle, SX(3, 1), SX(3, 1)) for side, ankle in ankles.items()}
        left, left_reach = leg_joints(robot, "L", hip, still["L"], margin, ops)
        right, right_reach = leg_joints(robot, "R", hip, still["R"], margin, ops)
        return Plan(
            joints={**left, **right, **arm_motions(more, ARM_SWING, duration, phase)},
            hip=hip.position,
            ankles=ankles,
            reach=vertcat(left_reach, right_reach),
        )

    return plan


def torso_shares(hip_y: SX, rule: TorsoShare, feet_y: Point2 = (0.05, -0.05)) -> dict[str, SX]:
    """Share of the torso's mass that each leg carries, from the hip's distances to the feet; both add up to 1.

    With signed distances, so that a hip beyond a foot gives a share beyond 0 and 1 and no kink.

    Args:
        hip_y: position of the hip across the walking direction [m].
        rule: ``"printed"`` is proportional to the distance *from* that leg's own foot, as in the equations; ``"lever"`` to
            the distance from the other foot, as the text says: the nearer foot carries more.
        feet_y: of the left and the right foot [m]; by default those of NAO.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (28), (29).
    """
    from_left, from_right = feet_y[0] - hip_y, hip_y - feet_y[1]
    width = feet_y[0] - feet_y[1]
    left, right = from_left / width, from_right / width  # (eqs. 28, 29)
    return {"L": left, "R": right} if rule == "printed" else {"L": right, "R": left}


def double_support_loads(robot: Robot, rule: TorsoShare, upright: Collection[str] | None = None) -> Loader:
    """Torques of each half from its own foot, and the combined ZMP of both feet; ``upright`` as for single support."""
    halves = {
        side: tree_from(robot, robot.feet[foot].link, [joint for joint in JOINTS if joint.startswith(side)])
        for side, foot in FEET.items()
    }
    weight, upright = robot.mass_kg * GRAVITY, upright_links(robot) if upright is None else upright
    feet_y = (leg_geometry(robot, "L").hip_m[1], leg_geometry(robot, "R").hip_m[1])

    def loads(joints: Mapping[str, Motion], hip: SX, feet: Mapping[str, SX]) -> Loads:
        q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
        shares = torso_shares(hip[1], rule, feet_y)
        torques: dict[str, SX] = {}
        zmps, ground_loads = [], []
        for side, tree in halves.items():
            half, wrench = newton_euler(tree, q, qd, qdd, GRAVITY, {robot.root: shares[side]}, upright)
            offset = zmp_of_wrench(wrench, robot.feet[FEET[side]].ankle_height_m, weight)
            torques |= half
            zmps.append(feet[side] + offset)
            ground_loads.append(ground_load(wrench, weight))
        return Loads(torques, combined_zmp(zmps, ground_loads))

    return loads


def double_support_margins(zmp: MX, box: Box[float] | Box[MX], ops: Nonsmooth) -> tuple[MX, MX]:
    """Balance margins in x and y, (1, N + 1) each [m]: distances to the sides of the box around both soles.

    Source:
        Gupta, Pratihar, Deb (2023), Fig. 8 (b).
    """
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(box.front - x, x - box.back).T, ops.min(box.left - y, y - box.right).T
