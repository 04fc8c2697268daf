"""NAO's double support phase: least mean power (Gupta, Pratihar, Deb 2023, sections 3.2 and 4.2).

The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
torso, which depends on where the hip is between the feet.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Generic, Literal, NamedTuple, TypeAlias, TypeVar

from casadi import DM, MX, SX, fmax

from nlp_gait.problem import GaitProblem, InstantPoint, Variable, maker
from nlp_gait.problems.biped.foot_loads import FootLimits, PlannedWrench, Start, planned_loads
from nlp_gait.problems.biped.parts import REACH_MARGIN, Margins, Part
from nlp_gait.problems.biped.phase import BOTH_FEET, Derivatives, Loader, Loads, Phase, PlannedInstant, Planner
from nlp_gait.problems.biped.samples import LEAST_DURATION
from nlp_gait.problems.nao.body import GRAVITY, JOINTS, PLANNED_JOINTS, nao, upright_links, upright_plan
from nlp_gait.problems.nao.curves import (
    Splines,
    Trajectory,
    arm_limits,
    arm_motions,
    grid_for,
    hip_and_arm_units,
    hip_on_spline,
)
from nlp_gait.problems.nao.legs import check_step_length, hip_variables, leg_geometry
from nlp_gait.problems.nao.motors import Motors
from nlp_gait.problems.nao.problem import Criterion, goal_of, paper_parts, phase_problem
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import below, combined_zmp, ground_load, zmp_of_wrench
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
DURATION = Variable(name="double_support_time_s", unit="s", lower=0.2, upper=2.0, description="x8")

Division = Literal["printed", "lever"]
TorsoShare = Literal["printed", "lever", "free"]
LOAD_DEGREE = 4
Point2: TypeAlias = tuple[float, float]
Side = TypeVar("Side", float, MX)


@maker(
    {"trajectory": "cubic", "objective": "power", "samples_per_interval": 1},
    {"motors": ""},
    {"load_degree": LOAD_DEGREE},
)
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
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Double support of NAO; for the options see ``problems.nao``."""
    check_step_length(step_length_m)
    real = Motors.parsed(motors, nao(robot, rotational_inertia))
    model = real.model
    soles = soles_of(model, step_length_m)
    box = support_box(model, soles)
    splines = Splines(trajectory=trajectory, units=hip_and_arm_units(ARM_SWING))
    sharing = load_sharing(model, torso_share, load_degree)
    richer = (arm_limits(model, splines, ARM_SWING, double_support_duration),)
    phase = Phase(
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=(*hip_variables(model), DURATION, *splines.variables, *sharing.variables),
        duration=DURATION.name,
        plan=sharing.planned(_planner(model, soles, splines)),
        loads=sharing.loads,
        grid=grid_for(trajectory, intervals, samples_per_interval, planned_loads=torso_share == "free"),
        derivatives=derivatives,
        parts=(
            *paper_parts(model, double_support_margins(box), double_support_mean_margins(box)),
            *(richer if splines.count else ()),
            *real.parts,
            *sharing.parts,
        ),
        goal=goal_of(objective, real),
        kinks=splines.kinks,
    )
    return phase_problem(
        "nao-dsp",
        "NAO, double support: least mean power",
        phase,
        robot,
        start=sharing.start_of(phase.names, splines.start_of(phase.names)),
        long_derivatives=bool(sharing.variables),
    )


def _joints_on(side: str) -> tuple[str, ...]:
    return tuple(joint for joint in JOINTS if joint.startswith(side))


def soles_of(robot: Robot, step: float) -> dict[str, Point2]:
    """Ankles on the ground: the right foot a step ahead, each below its own hip joint (section 4.2)."""
    return {"L": (step, leg_geometry(robot, "L").hip_m[1]), "R": (2 * step, leg_geometry(robot, "R").hip_m[1])}


def standing_ankles(robot: Robot, soles: Mapping[str, Point2]) -> dict[str, SX]:
    """Ankles (3,) by side, above where the feet stand [m]."""
    return {side: SX(DM([*xy, leg_geometry(robot, side).ankle_height_m])) for side, xy in soles.items()}


def double_support_duration(at: InstantPoint) -> SX:
    """Time of the phase [s], never zero."""
    return fmax(at[DURATION.name], LEAST_DURATION)


def double_support_hip(at: InstantPoint, more: Mapping[str, Motion], soles: Mapping[str, Point2], phase: SX) -> Motion:
    """Motion of the torso's origin (3,) between standing feet [m] (Table 5, rows 1 to 3), and what each curve adds.

    The hip moves from a sixth of a step ahead of the rear foot to a sixth behind the front one, rounded to a micrometre so
    that the paper's numbers come out exactly, and from halfway to the left foot to halfway to the right one.
    """
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6
    hip_x, hip_y = (round(rear_x + sixth, 6), round(front_x - sixth, 6)), (left_y / 2, right_y / 2)
    return hip_on_spline(at, more, hip_x, hip_y, double_support_duration(at), phase)


class Box(NamedTuple, Generic[Side]):
    """Sides of the rectangle around both soles [m]."""

    back: Side
    front: Side
    right: float
    left: float


def support_box(robot: Robot, soles: Mapping[str, Point2]) -> Box[float]:
    """Rectangle around both soles, whose ankles stand at ``soles`` by side."""
    feet = {side: robot.feet[foot] for side, foot in BOTH_FEET.items()}
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
    ankles = {side: Motion(ankle, SX(3, 1), SX(3, 1)) for side, ankle in standing_ankles(robot, soles).items()}

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        duration = double_support_duration(at)
        more = splines.motions(at, duration, phase)
        hip = double_support_hip(at, more, soles, phase)
        arms = arm_motions(more, ARM_SWING, duration, phase)
        return upright_plan(robot, hip, ankles, arms, at[REACH_MARGIN], ops)

    return plan


def torso_shares(hip_y: SX, rule: Division, feet_y: Point2 = (0.05, -0.05)) -> dict[str, SX]:
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


class Sharing(NamedTuple):
    """What sharing the load in double support adds to a problem.

    Attributes:
        variables: of the planned wrench.
        planned: adds that wrench to a motion.
        loads: torques and ZMP.
        parts: that limit it.
        start_of: start points of variables by name, from those of the others.
    """

    variables: tuple[Variable, ...]
    planned: Callable[[Planner], Planner]
    loads: Loader
    parts: tuple[Part, ...]
    start_of: Callable[[Sequence[str], Start | None], Start | None]


def load_sharing(robot: Robot, rule: TorsoShare, degree: int, upright: Collection[str] | None = None) -> Sharing:
    """By a rule of the paper, or planned freely.

    Args:
        robot: with links welded that never move.
        rule: see ``torso_shares``; ``"free"`` plans the wrench on the right foot.
        degree: of that wrench over the phase.
        upright: as for single support.
    """
    if rule != "free":
        return Sharing((), lambda plan: plan, double_support_loads(robot, rule, upright), (), lambda _, start: start)
    weight = robot.mass_kg * GRAVITY
    wrench = PlannedWrench(robot=robot, weight=weight, degree=degree)
    loads = planned_loads(robot, GRAVITY, upright_links(robot) if upright is None else upright)
    return Sharing(wrench.variables, wrench.planned, loads, (FootLimits(wrench),), wrench.start_of)


def double_support_loads(robot: Robot, rule: Division, upright: Collection[str] | None = None) -> Loader:
    """Torques of each half from its own foot, and the combined ZMP of both feet; ``upright`` as for single support."""
    halves = {side: tree_from(robot, robot.feet[foot].link, _joints_on(side)) for side, foot in BOTH_FEET.items()}
    weight, upright = robot.mass_kg * GRAVITY, upright_links(robot) if upright is None else upright
    feet_y = (leg_geometry(robot, "L").hip_m[1], leg_geometry(robot, "R").hip_m[1])

    def loads(joints: Mapping[str, Motion], hip: SX, feet: Mapping[str, SX], _: SX) -> Loads:
        q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
        shares = torso_shares(hip[1], rule, feet_y)
        torques: dict[str, SX] = {}
        zmps, ground_loads, wrenches = [], [], {}
        for side, tree in halves.items():
            half, wrench = newton_euler(tree, q, qd, qdd, GRAVITY, {robot.root: shares[side]}, upright)
            height = robot.feet[BOTH_FEET[side]].ankle_height_m
            offset = zmp_of_wrench(wrench, height, weight)
            wrenches[side] = below(wrench, height)
            torques |= half
            zmps.append(feet[side] + offset)
            ground_loads.append(ground_load(wrench, weight))
        return Loads(torques, combined_zmp(zmps, ground_loads), wrenches)

    return loads


def double_support_margins(box: Box[float]) -> Margins:
    """Balance margins in x and y: distances to the sides of the box around both soles.

    Source:
        Gupta, Pratihar, Deb (2023), Fig. 8 (b).
    """
    return lambda zmp, at, ops: margins_in(box, zmp, ops)


def margins_in(box: Box[float] | Box[MX], zmp: MX, ops: Nonsmooth) -> tuple[MX, MX]:
    """Distances (1, N + 1) of the ZMP (2, N + 1) to the sides of a box in x and in y [m]."""
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(box.front - x, x - box.back).T, ops.min(box.left - y, y - box.right).T
