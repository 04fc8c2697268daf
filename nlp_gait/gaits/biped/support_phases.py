"""Single support on the left foot, while the right one swings by two steps, and double support with the right one a step ahead.

Phases of sections 3 and 4 of Gupta, Pratihar, Deb (2023), with the margins of the ZMP on a sole and around both.
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

from casadi import MX, SX

from nlp_gait.formulation import Array, Grid, InstantPoint, Point
from nlp_gait.gaits.biped.body import (
    LIFT,
    TIMES,
    Body,
    Support,
    make_hip_variables,
    make_lift_variable,
    make_time_variable,
    read_duration,
)
from nlp_gait.gaits.biped.curves import Trajectory, move_hip
from nlp_gait.gaits.biped.footholds import Foothold, find_support_sides
from nlp_gait.gaits.biped.limits import (
    REACH_MARGIN,
    BalanceMargins,
    Box,
    Goal,
    Margins,
    SplineClearance,
    compute_margins,
)
from nlp_gait.gaits.biped.phase import Derivatives, Phase
from nlp_gait.gaits.biped.phase_problem import make_phase
from nlp_gait.gaits.biped.samples import BOTH_FEET, Instant, Loader
from nlp_gait.robots import Foot, Robot
from nlp_gait.symbolic import trajectories
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

# Least mean margins: 0.05 m and 0.02 m on NAO's sole of 0.15 m by 0.08 m (section 4.1); 0.08 m in the box of 0.21 m by 0.18 m
# around both soles (section 4.2).
SOLE_SHARES, BOX_SHARES = (1 / 3, 1 / 4), (8 / 21, 4 / 9)
LEAST_SLANT = 1e-2  # component of a side's normal along an axis, below which there is no distance to the side along it

Point2: TypeAlias = tuple[float, float]


def make_support_box(robot: Robot, soles: Mapping[str, Point2]) -> Box[float]:
    """Return the rectangle around both soles, whose ankles are at ``soles`` by side [m]."""
    feet = {side: robot.feet[foot] for side, foot in BOTH_FEET.items()}
    return Box(
        back=min(soles[side][0] - foot.back_m for side, foot in feet.items()),
        front=max(soles[side][0] + foot.front_m for side, foot in feet.items()),
        right=min(soles[side][1] - foot.right_m for side, foot in feet.items()),
        left=max(soles[side][1] + foot.left_m for side, foot in feet.items()),
    )


def compute_mean_margins(shares: Point2, length: float, width: float) -> Point2:
    """Return the least mean balance margins in x and y as shares of a support, to a tenth of a millimetre [m]."""
    return round(shares[0] * length, 4), round(shares[1] * width, 4)


def limit_to_sole(body: Body, support_xy: Point2, least_m: Point2 = (0.0, 0.0)) -> BalanceMargins:
    """Return the limit of the ZMP on the left sole, whose ankle is at ``support_xy``, by default without least margins [m]."""
    means = compute_sole_margins(body.robot.feet["left"])
    return BalanceMargins(body.make_sole_margins(support_xy), means, least_m)


def compute_sole_margins(foot: Foot, shares: Point2 = SOLE_SHARES) -> Point2:
    """Return margins on one sole as shares of its size, by default the least mean ones [m]."""
    return compute_mean_margins(shares, foot.back_m + foot.front_m, foot.left_m + foot.right_m)


def limit_to_box(box: Box[float], margins: Margins | None = None) -> BalanceMargins:
    """Return the limit of the ZMP in the box around both soles (Fig. 8 (b)); other margins may replace the box's own."""
    return BalanceMargins(
        margins or (lambda zmp, point, ops: compute_margins(box, zmp, ops)),
        compute_mean_margins(BOX_SHARES, box.front - box.back, box.left - box.right),
    )


def limit_to_hull(body: Body, right_sole: Array) -> BalanceMargins:
    """Return the limit of the ZMP in the hull of both soles: the left one at x = 0, and the right one with these corners (4, 2).

    Margins are distances to the sides along x and y; the mean ones are those of a single sole.
    """
    soles = body.robot.feet
    sides = find_support_sides([Foothold(0.0, body.feet_y[0], 0.0).outline(soles["left"]), right_sole]).tolist()

    def margins(zmp: MX, point: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        def measure(axis: int) -> MX:
            slanted = [side for side in sides if abs(side[axis]) > LEAST_SLANT]
            return ops.min(*(((d - x * zmp[0, :] - y * zmp[1, :]) / abs((x, y)[axis])).T for x, y, d in slanted)).T

        return measure(0), measure(1)

    return BalanceMargins(margins, compute_sole_margins(soles["left"]))


class Stance(NamedTuple):
    """Place of the left foot, and paths of the right foot and of the hip [m]."""

    support_xy: Point2
    swing_x: Point2
    swing_y: float
    hip_x: Point2
    hip_y: Point2


def place_stance(body: Body, step_m: float) -> Stance:
    """Place each foot below its own hip joint, and the hip halfway to the supporting one (section 4.1, Table 3)."""
    left, right = body.feet_y
    return Stance((step_m, left), (0.0, 2 * step_m), right, (step_m / 2, 1.5 * step_m), (left / 2, left / 2))


def place_soles(body: Body, step_m: float) -> dict[str, Point2]:
    """Place the ankles on the ground: the right foot a step ahead, each below its own hip joint (section 4.2) [m]."""
    left, right = body.feet_y
    return {"L": (step_m, left), "R": (2 * step_m, right)}


def place_hip(body: Body, soles: Mapping[str, Point2]) -> tuple[Point2, Point2]:
    """Return the hip's x, from a sixth of a step ahead of the rear foot to one behind the front foot, and y, at both ends [m]."""
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6
    return (body.round_place(rear_x + sixth), body.round_place(front_x - sixth)), (left_y / 2, right_y / 2)


def make_support_phase(
    body: Body,
    name: Support,
    step_m: float,
    trajectory: Trajectory,
    grid: Grid,
    goal: Goal,
    loads: Loader | None = None,
    derivatives: Derivatives = "analytic",
) -> Phase:
    """Return a phase with feet ``step_m`` apart; ``loads`` are those of double support, None in single support.

    Single support is from rest behind the standing foot to rest in front of it, double support from touch-down of the right foot,
    a step ahead of the left one, to lift-off of the left one.
    """
    swings, soles, stance = name == Support.SINGLE, place_soles(body, step_m), place_stance(body, step_m)
    hip_places = (stance.hip_x, stance.hip_y) if swings else place_hip(body, soles)
    standing = {side: trajectories.resting_point((x, *body.ankle(side))) for side, (x, _) in soles.items()}
    splines = body.make_splines(name, trajectory)

    def swing(point: InstantPoint, curves_added: Mapping[str, Motion], height: float, s: SX) -> Motion:
        """The paper's motion of the right foot at a height, and what its curves add."""
        time, (begin, end) = read_duration(point, name), stance.swing_x
        paper = swing_foot(SX(begin), SX(end), stance.swing_y, height, point[LIFT], time, s)
        curves = (curves_added["foot_x"], trajectories.constant_motion(0.0), curves_added["foot_z"])
        return trajectories.add_motions(paper, trajectories.stack(*curves))

    def sole(point: InstantPoint, s: SX) -> SX:
        return swing(point, splines.motions(point, read_duration(point, name), s), 0.0, s).position

    def plan(point: InstantPoint, s: SX, ops: Nonsmooth) -> Instant:
        time = read_duration(point, name)
        curves = splines.motions(point, time, s)
        hip, angles = move_hip(point, curves, *hip_places, time, s), body.angles(name, point, curves, time, s)
        ankles = {**standing, "R": swing(point, curves, body.ankle("R")[1], s)} if swings else standing
        return body.plan(hip, angles, ankles, point[REACH_MARGIN], ops)

    balance = limit_to_sole(body, stance.support_xy) if swings else limit_to_box(make_support_box(body.robot, soles))
    clearance = (SplineClearance(sole, step_m, LIFT),) if swings and splines.count else ()
    curve_limits = body.make_curve_limits(name, splines.count)
    lift = (make_lift_variable(body),) if swings else ()
    last = (*lift, make_time_variable(body, name), *splines.variables)
    variables = (*make_hip_variables(body), *body.angle_variables, *last)
    names = [variable.name for variable in variables]
    return make_phase(
        body,
        name,
        balance,
        loads,
        (*clearance, *curve_limits),
        variables=variables,
        duration=TIMES[name],
        plan=plan,
        grid=grid,
        derivatives=derivatives,
        goal=goal,
        kinks=splines.kinks,
        start=splines.start_of(names),
    )


def swing_foot(
    start_x: SX,
    end_x: SX,
    y: float,
    ankle_height: float,
    lift: SX,
    duration: SX,
    phase: SX,
) -> Motion:
    """Return the motion of a swinging foot's ankle (3,) over a parabola [m], from rest to rest (Table 3, rows 1 and 2)."""
    forward = trajectories.cubic(start_x, end_x, SX(0), SX(0), duration, phase)
    rise = trajectories.parabola_lift(forward, start_x, end_x, lift)
    return trajectories.stack(
        forward, trajectories.constant_motion(y), rise._replace(position=rise.position + ankle_height)
    )
