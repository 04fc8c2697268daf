"""Single support: the robot stands on its left foot and swings the right one by two steps (sections 3.1 and 4.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from casadi import MX, SX

from nlp_gait.formulation import GaitProblem, Grid, InstantPoint, Point
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, State, read_duration
from nlp_gait.gaits.biped.curves import PhaseTrajectory, Splines, hip_on_spline
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import REACH_MARGIN, FootClearance, Margins
from nlp_gait.gaits.biped.phase import Derivatives, Phase
from nlp_gait.gaits.biped.phase_problem import make_phase_limits, make_phase_problem
from nlp_gait.gaits.biped.samples import Instant, Loader
from nlp_gait.robots import Foot
from nlp_gait.symbolic.balance import shift_down, zmp_of_wrench
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, cubic, parabola_lift, stack

# Section 4.1: least mean margins of 0.05 m and 0.02 m, on NAO's sole of 0.15 m by 0.08 m.
MEAN_DBM_SHARES = (1 / 3, 1 / 4)


class Stance(NamedTuple):
    """Place of the left foot, and paths of the right foot and of the hip [m]."""

    support_xy: tuple[float, float]
    swing_x: tuple[float, float]
    swing_y: float
    hip_x: tuple[float, float]
    hip_y: tuple[float, float]


def place_stance(body: Body, step_m: float) -> Stance:
    """Place each foot below its own hip joint, and the hip halfway to the supporting one (section 4.1, Table 3)."""
    left, right = body.feet_y
    return Stance((step_m, left), (0.0, 2 * step_m), right, (step_m / 2, 1.5 * step_m), (left / 2, left / 2))


def plan_single_support(
    body: Body,
    step_m: float,
    grid: Grid,
    trajectory: PhaseTrajectory,
    goal: Goal,
    derivatives: Derivatives = "analytic",
) -> GaitProblem:
    """Return the problem of single support; for the options see ``gaits.nao``."""
    splines = body.make_splines("ssp", trajectory)
    phase = make_single_support_phase(body, step_m, splines, grid, goal, derivatives)
    return make_phase_problem("ssp", "single support: least mean power", phase, start=splines.start_of(phase.names))


def make_single_support_phase(
    body: Body, step_m: float, splines: Splines, grid: Grid, goal: Goal, derivatives: Derivatives = "analytic"
) -> Phase:
    """Return the phase from rest behind the standing foot to rest in front of it, with feet ``step_m`` apart."""
    stance, foot = place_stance(body, step_m), body.robot.feet["left"]
    hip, measured = body.split_hip(splines, stance.hip_x, stance.hip_y)
    left, (_, right_height) = body.standing_ankle("L", step_m), body.ankle("R")

    def swing(at: InstantPoint, more: Mapping[str, Motion], height: float, s: SX) -> Motion:
        """The paper's motion of the right foot at a height, and what its curves add."""
        time, (begin, end) = read_duration(at, "ssp"), stance.swing_x
        paper = swing_foot(SX(begin), SX(end), stance.swing_y, height, at[LIFT], time, s)
        return add_motions(paper, stack(more["foot_x"], constant_motion(0.0), more["foot_z"]))

    def state(at: InstantPoint, s: SX) -> State:
        time = read_duration(at, "ssp")
        more = splines.motions(at, time, s)
        hip = hip_on_spline(at, more, stance.hip_x, stance.hip_y, time, s, splines.is_measured)
        return hip, body.angles("ssp", at, more, time, s), {"L": left, "R": swing(at, more, right_height, s)}

    def plan(at: InstantPoint, s: SX, ops: Nonsmooth) -> Instant:
        return body.plan(*state(at, s), at[REACH_MARGIN], ops)

    def sole(at: InstantPoint, s: SX) -> SX:
        return swing(at, splines.motions(at, read_duration(at, "ssp"), s), 0.0, s).position

    return Phase(
        body=body,
        variables=(
            *hip,
            *body.angle_variables,
            body.lift_variable,
            body.make_time_variable("ssp"),
            *splines.variables,
        ),
        duration=TIMES["ssp"],
        plan=plan,
        loads=make_single_support_loads(body),
        grid=grid,
        derivatives=derivatives,
        limits=(
            *make_phase_limits(
                body, body.make_sole_margins(stance.support_xy), compute_single_support_mean_margins(foot)
            ),
            *((FootClearance(sole, step_m, LIFT),) if splines.count else ()),
            *body.make_curve_limits("ssp", splines.count, state),
            *body.motors.limits,
        ),
        goal=goal,
        state=measured,
        kinks=splines.kinks,
    )


def compute_single_support_mean_margins(foot: Foot) -> tuple[float, float]:
    """Return the least mean balance margins in x and y as shares of the sole, to a tenth of a millimetre [m]."""
    along, across = MEAN_DBM_SHARES
    return round(along * (foot.back_m + foot.front_m), 4), round(across * (foot.left_m + foot.right_m), 4)


def make_nearest_edge_margins(support_xy: tuple[float, float], foot: Foot) -> Margins:
    """Return the distances of the ZMP to the nearer edges of one sole in x and in y, whose ankle is at ``support_xy`` [m]."""

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        x, y = (zmp[0, :] - support_xy[0]).T, (zmp[1, :] - support_xy[1]).T
        along = ops.min(foot.front_m - x, x + foot.back_m)
        return along.T, ops.min(foot.left_m - y, y + foot.right_m).T

    return margins


def swing_foot(start_x: SX, end_x: SX, y: float, ankle_height: float, lift: SX, duration: SX, phase: SX) -> Motion:
    """Return the motion of a swinging foot's ankle (3,) from rest to rest over a parabola [m] (Table 3, rows 1 and 2)."""
    forward = cubic(start_x, end_x, SX(0), SX(0), duration, phase)
    rise = parabola_lift(forward, start_x, end_x, lift)
    return stack(forward, constant_motion(y), rise._replace(position=rise.position + ankle_height))


def make_single_support_loads(body: Body) -> Loader:
    """Return a function of the torques from the left foot, which supports the robot, and of the ZMP under it."""
    foot = body.robot.feet["left"]

    def loads(now: Instant) -> Instant:
        torques, wrench = body.compute_torques(foot.link, tuple(body.robot.joints), now.joints)
        offset = zmp_of_wrench(wrench, foot.ankle_height_m, body.weight)
        wrenches = {"L": shift_down(wrench, foot.ankle_height_m), "R": SX(6, 1)}
        return now._replace(torques=torques, zmp=now.ankles["L"][:2] + offset, wrenches=wrenches)

    return loads
