"""NAO's double support phase: least mean power (Gupta, Pratihar, Deb 2023, sections 3.2 and 4.2).

The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
torso, which depends on where the hip is between the feet.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial

from casadi import DM, SX, fmax

from nlp_gait.formulation import GaitProblem, InstantPoint, Variable, maker
from nlp_gait.gaits.biped.curves import Splines, Trajectory, grid_for, hip_on_spline
from nlp_gait.gaits.biped.double_support import (
    LOAD_DEGREE,
    Point2,
    Standing,
    TorsoShare,
    double_support_margins,
    double_support_mean_margins,
    support_box,
)
from nlp_gait.gaits.biped.instant import PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN
from nlp_gait.gaits.biped.phase import Derivatives, Phase
from nlp_gait.gaits.biped.problem import Criterion, goal_of
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.gaits.nao.body import GRAVITY, JOINTS, PLANNED_JOINTS, nao, upright_links, upright_plan
from nlp_gait.gaits.nao.curves import arm_limits, arm_motions, hip_and_arm_units
from nlp_gait.gaits.nao.least_power.power_form import FORM_OPTIONS, power_form_maker
from nlp_gait.gaits.nao.least_power.power_instants import double_support_phase
from nlp_gait.gaits.nao.legs import check_step_length, hip_variables, leg_geometry
from nlp_gait.gaits.nao.motors import nao_motors
from nlp_gait.gaits.nao.problem import paper_parts, phase_problem
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

ARM_SWING = {  # Table 5, rows 4 to 7 [rad]
    "LShoulderPitch": (1.0, 1.5),
    "LElbowRoll": (-0.64, -0.50),
    "RShoulderPitch": (2.0, 1.5),
    "RElbowRoll": (0.42, 0.50),
}
DURATION = Variable(name="double_support_time_s", unit="s", lower=0.2, upper=2.0, description="x8")


@maker
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
    """Double support of NAO; for the options see ``gaits.nao``.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.2 and 4.2.
    """
    check_step_length(step_length_m)
    real = nao_motors(motors, nao(robot, rotational_inertia))
    model = real.model
    soles = soles_of(model, step_length_m)
    box = support_box(model, soles)
    splines = Splines(trajectory=trajectory, units=hip_and_arm_units(ARM_SWING))
    sharing = standing(model).sharing(torso_share, load_degree)
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
    power_form = None
    paper = (derivatives, trajectory, objective, motors) == FORM_OPTIONS and samples_per_interval < 2
    if paper and torso_share != "free":
        instants = partial(double_support_phase, model, soles, hip_ends(soles), ARM_SWING, torso_share)
        power_form = power_form_maker(model, instants)
    problem = phase_problem(
        "nao-dsp",
        "NAO, double support: least mean power",
        phase,
        robot,
        start=sharing.start_of(phase.names, splines.start_of(phase.names)),
    )
    return replace(problem, power_form=power_form)


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
    """Motion of the torso's origin (3,) between standing feet [m] (Table 5, rows 1 to 3), and what each curve adds."""
    return hip_on_spline(at, more, *hip_ends(soles), double_support_duration(at), phase)


def hip_ends(soles: Mapping[str, Point2]) -> tuple[Point2, Point2]:
    """Where the torso's origin is at both ends in x and in y [m].

    The hip moves from a sixth of a step ahead of the rear foot to a sixth behind the front one, rounded to a micrometre so
    that the paper's numbers come out exactly, and from halfway to the left foot to halfway to the right one.
    """
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6
    return (round(rear_x + sixth, 6), round(front_x - sixth, 6)), (left_y / 2, right_y / 2)


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


def standing(robot: Robot, upright: Collection[str] | None = None) -> Standing:
    """NAO on both feet; ``upright``: links that never turn, None for those under an upright torso."""
    return Standing(
        robot=robot,
        halves={side: tuple(joint for joint in JOINTS if joint.startswith(side)) for side in "LR"},
        feet_y=(leg_geometry(robot, "L").hip_m[1], leg_geometry(robot, "R").hip_m[1]),
        gravity=GRAVITY,
        upright=upright_links(robot) if upright is None else upright,
    )
