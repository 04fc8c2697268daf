"""Double support: both feet stand, the right one a step ahead, and the load passes to it (sections 3.2 and 4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic, NamedTuple, TypeAlias, TypeVar

from casadi import MX, SX

from nlp_gait.formulation import GaitProblem, Grid, InstantPoint
from nlp_gait.gaits.biped.body import TIMES, Body, State, read_duration
from nlp_gait.gaits.biped.curves import PhaseTrajectory, Splines, hip_on_spline
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import REACH_MARGIN, Margins
from nlp_gait.gaits.biped.load_sharing import LoadSharing
from nlp_gait.gaits.biped.phase import Derivatives, Phase
from nlp_gait.gaits.biped.phase_problem import make_phase_limits, make_phase_problem
from nlp_gait.gaits.biped.samples import BOTH_FEET, Instant
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import resting_point

# Section 4.2: least mean margins of 0.08 m, in the box of 0.21 m by 0.18 m around NAO's soles.
MEAN_DBM_SHARES = (8 / 21, 4 / 9)

Point2: TypeAlias = tuple[float, float]
Side = TypeVar("Side", float, MX)


class Box(NamedTuple, Generic[Side]):
    """Sides of the rectangle around both soles [m]."""

    back: Side
    front: Side
    right: float
    left: float


def make_support_box(robot: Robot, soles: Mapping[str, Point2]) -> Box[float]:
    """Return the rectangle around both soles, whose ankles are at ``soles`` by side [m]."""
    feet = {side: robot.feet[foot] for side, foot in BOTH_FEET.items()}
    return Box(
        back=min(soles[side][0] - foot.back_m for side, foot in feet.items()),
        front=max(soles[side][0] + foot.front_m for side, foot in feet.items()),
        right=min(soles[side][1] - foot.right_m for side, foot in feet.items()),
        left=max(soles[side][1] + foot.left_m for side, foot in feet.items()),
    )


def compute_double_support_mean_margins(box: Box[float]) -> Point2:
    """Return the least mean balance margins in x and y as shares of the box, to a tenth of a millimetre [m]."""
    along, across = MEAN_DBM_SHARES
    return round(along * (box.front - box.back), 4), round(across * (box.left - box.right), 4)


def make_double_support_margins(box: Box[float]) -> Margins:
    """Return the balance margins in x and y: distances to the sides of the box around both soles.

    Source:
        Gupta, Pratihar, Deb (2023), Fig. 8 (b).
    """
    return lambda zmp, at, ops: compute_margins(box, zmp, ops)


def compute_margins(box: Box[float] | Box[MX], zmp: MX, ops: Nonsmooth) -> tuple[MX, MX]:
    """Compute the distances (1, N + 1) of the ZMP (2, N + 1) to the sides of a box in x and in y [m]."""
    x, y = zmp[0, :].T, zmp[1, :].T
    return ops.min(box.front - x, x - box.back).T, ops.min(box.left - y, y - box.right).T


def place_soles(body: Body, step_m: float) -> dict[str, Point2]:
    """Place the ankles on the ground: the right foot a step ahead, each below its own hip joint (section 4.2) [m]."""
    left, right = body.feet_y
    return {"L": (step_m, left), "R": (2 * step_m, right)}


def hip_ends(body: Body, soles: Mapping[str, Point2]) -> tuple[Point2, Point2]:
    """Return the hip's place at both ends in x and in y [m].

    The hip moves from a sixth of a step ahead of the rear foot to a sixth behind the front one, and from halfway to the left
    foot to halfway to the right one.
    """
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6
    return (body.round_place(rear_x + sixth), body.round_place(front_x - sixth)), (left_y / 2, right_y / 2)


def plan_double_support(
    body: Body,
    step_m: float,
    grid: Grid,
    trajectory: PhaseTrajectory,
    goal: Goal,
    sharing: LoadSharing,
    derivatives: Derivatives = "analytic",
) -> GaitProblem:
    """Return the problem of double support; for the options see ``gaits.nao``."""
    splines = body.make_splines("dsp", trajectory)
    phase = make_double_support_phase(body, step_m, splines, sharing, grid, goal, derivatives)
    start = sharing.start(phase.names, splines.start_of(phase.names))
    return make_phase_problem("dsp", "double support: least mean power", phase, start=start)


def make_double_support_phase(
    body: Body,
    step_m: float,
    splines: Splines,
    sharing: LoadSharing,
    grid: Grid,
    goal: Goal,
    derivatives: Derivatives = "analytic",
) -> Phase:
    """Return the phase from touch-down of the right foot, ``step_m`` ahead of the left one, to lift-off of the left one."""
    soles = place_soles(body, step_m)
    box, ends = make_support_box(body.robot, soles), hip_ends(body, soles)
    variables, measured = body.split_hip(splines, *ends)
    ankles = {side: resting_point((x, *body.ankle(side))) for side, (x, _) in soles.items()}

    def state(at: InstantPoint, s: SX) -> State:
        more = splines.motions(at, read_duration(at, "dsp"), s)
        hip = hip_on_spline(at, more, *ends, read_duration(at, "dsp"), s, splines.is_measured)
        return hip, body.angles("dsp", at, more, read_duration(at, "dsp"), s), ankles

    def plan(at: InstantPoint, s: SX, ops: Nonsmooth) -> Instant:
        return body.plan(*state(at, s), at[REACH_MARGIN], ops)

    return Phase(
        body=body,
        variables=(
            *variables,
            *body.angle_variables,
            body.make_time_variable("dsp"),
            *splines.variables,
            *sharing.variables,
        ),
        duration=TIMES["dsp"],
        plan=sharing.add_to(plan),
        loads=sharing.loads,
        grid=grid,
        derivatives=derivatives,
        limits=(
            *make_phase_limits(body, make_double_support_margins(box), compute_double_support_mean_margins(box)),
            *body.make_curve_limits("dsp", splines.count, state),
            *body.motors.limits,
            *sharing.limits,
        ),
        goal=goal,
        state=measured,
        kinks=splines.kinks,
    )
