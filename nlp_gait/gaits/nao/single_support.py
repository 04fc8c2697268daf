"""NAO's single support phase: least mean power (Gupta, Pratihar, Deb 2023, sections 3.1 and 4.1)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from casadi import MX, SX, fmax

from nlp_gait.formulation import GaitProblem, InstantPoint, Point, Variable, maker
from nlp_gait.gaits.biped.curves import Splines, Trajectory, grid_for, hip_on_spline
from nlp_gait.gaits.biped.instant import Loader, PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN, FootClearance, Margins
from nlp_gait.gaits.biped.phase import Derivatives, Phase
from nlp_gait.gaits.biped.problem import Criterion, goal_of
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.gaits.biped.single_support import loads_on_left, single_support_mean_margins, swing_foot
from nlp_gait.gaits.nao.body import GRAVITY, JOINTS, PLANNED_JOINTS, nao, upright_links, upright_plan
from nlp_gait.gaits.nao.curves import arm_limits, arm_motions, hip_and_arm_units
from nlp_gait.gaits.nao.least_power.power_form import FORM_OPTIONS, power_form_maker
from nlp_gait.gaits.nao.least_power.power_instants import single_support_phase
from nlp_gait.gaits.nao.legs import check_step_length, hip_variables, leg_geometry
from nlp_gait.gaits.nao.motors import nao_motors
from nlp_gait.gaits.nao.problem import paper_parts, phase_problem
from nlp_gait.robots import Foot, Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, stack

ARM_SWING = {  # Table 3, rows 6 to 9 [rad]
    "LShoulderPitch": (2.0, 1.0),
    "LElbowRoll": (-0.42, -0.64),
    "RShoulderPitch": (1.0, 2.0),
    "RElbowRoll": (0.64, 0.42),
}

# Curves that can be splines; the swing foot stays on its line across the walking direction.
UNITS = hip_and_arm_units(ARM_SWING) | {"foot_x": "m", "foot_z": "m"}

DURATION, LIFT = "single_support_time_s", "swing_height_m"
OWN_VARIABLES = (
    Variable(name=LIFT, unit="m", lower=0.015, upper=0.03, description="x8, highest point of the foot"),
    Variable(name=DURATION, unit="s", lower=0.4, upper=4.0, description="x9"),
)


@maker
def nao_ssp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length. For the options see ``gaits.nao``.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    check_step_length(step_length_m)
    real = nao_motors(motors, nao(robot, rotational_inertia))
    model = real.model
    stance, foot = stance_of(model, step_length_m), model.feet["left"]
    splines = Splines(trajectory=trajectory, units=UNITS)

    def path(at: InstantPoint, s: SX) -> SX:
        return _swing(at, stance, splines.motions(at, single_support_duration(at), s), 0.0, s).position

    richer = (
        FootClearance(path, sum(stance.swing_x) / 2, LIFT),
        arm_limits(model, splines, ARM_SWING, single_support_duration),
    )
    phase = Phase(
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=(*hip_variables(model), *OWN_VARIABLES, *splines.variables),
        duration=DURATION,
        plan=single_support_plan(model, stance, splines),
        loads=single_support_loads(model),
        grid=grid_for(trajectory, intervals, samples_per_interval),
        derivatives=derivatives,
        parts=(
            *paper_parts(model, single_support_margins(stance.support_xy, foot), single_support_mean_margins(foot)),
            *(richer if splines.count else ()),
            *real.parts,
        ),
        goal=goal_of(objective, real),
        kinks=splines.kinks,
    )
    power_form = None
    if (derivatives, trajectory, objective, motors) == FORM_OPTIONS and samples_per_interval < 2:
        power_form = power_form_maker(model, partial(single_support_phase, model, *stance, ARM_SWING))
    problem = phase_problem(
        "nao-ssp",
        "NAO, single support: least mean power",
        phase,
        robot,
        start=splines.start_of(phase.names),
    )
    return replace(problem, power_form=power_form)


class Stance(NamedTuple):
    """Where the left foot stands, and paths of the right foot and of the hip [m]."""

    support_xy: tuple[float, float]
    swing_x: tuple[float, float]
    swing_y: float
    hip_x: tuple[float, float]
    hip_y: tuple[float, float]


def stance_of(robot: Robot, step: float) -> Stance:
    """Each foot below its own hip joint, the hip halfway to the supporting one (section 4.1, Table 3)."""
    left, right = (leg_geometry(robot, side).hip_m[1] for side in "LR")
    return Stance((step, left), (0.0, 2 * step), right, (step / 2, 1.5 * step), (left / 2, left / 2))


def single_support_plan(robot: Robot, stance: Stance, splines: Splines) -> Planner:
    """Motion of hip, swing foot and arms (Table 3), and of the joints by inverse kinematics."""
    ankle_heights = [robot.feet[side].ankle_height_m for side in ("left", "right")]

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        duration = single_support_duration(at)
        more = splines.motions(at, duration, phase)
        hip = hip_on_spline(at, more, stance.hip_x, stance.hip_y, duration, phase)
        ankles = {
            "L": stack(*map(constant_motion, (*stance.support_xy, ankle_heights[0]))),
            "R": _swing(at, stance, more, ankle_heights[1], phase),
        }
        arms = arm_motions(more, ARM_SWING, duration, phase)
        return upright_plan(robot, hip, ankles, arms, at[REACH_MARGIN], ops)

    return plan


def single_support_duration(at: InstantPoint) -> SX:
    """Time of the phase [s], never zero."""
    return fmax(at[DURATION], LEAST_DURATION)


def _swing(at: InstantPoint, stance: Stance, more: Mapping[str, Motion], ankle_height: float, phase: SX) -> Motion:
    """Motion of the right ankle (3,) [m]: the paper's, and what its curves add."""
    ends = SX(stance.swing_x[0]), SX(stance.swing_x[1])
    swing = swing_foot(*ends, stance.swing_y, ankle_height, at[LIFT], single_support_duration(at), phase)
    return add_motions(swing, stack(more["foot_x"], constant_motion(0.0), more["foot_z"]))


def single_support_loads(robot: Robot, upright: Collection[str] | None = None) -> Loader:
    """Loads of NAO on its left foot; ``upright``: links that never turn, None for those under an upright torso."""
    return loads_on_left(robot, GRAVITY, upright_links(robot) if upright is None else upright)


def single_support_margins(support_xy: tuple[float, float], foot: Foot) -> Margins:
    """Balance margins in x and y on one sole.

    In x the distance to the sole's edge on that side of the ankle on which the ZMP lies: it jumps at the ankle, as printed.
    Outside the sole the paper's zero is continued below zero, so that an infeasible gait says how far outside it is.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (21), (22).
    """

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        x, y = zmp[0, :] - support_xy[0], zmp[1, :] - support_xy[1]
        dbm_x = ops.step(x, x + foot.back_m, foot.front_m - x)
        dbm_y = ops.min((foot.left_m - y).T, (y + foot.right_m).T).T
        return dbm_x, dbm_y

    return margins
