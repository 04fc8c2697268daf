"""Single support of any humanoid: least mean power of one step's swing (after Gupta, Pratihar, Deb 2023, section 4.1)."""

from __future__ import annotations

from collections.abc import Mapping

from casadi import MX, SX, fmax

from nlp_gait.formulation import GaitProblem, InstantPoint, Point, Variable, maker
from nlp_gait.gaits.biped.curves import HIP_CURVES, Splines, Trajectory, grid_for, hip_on_spline
from nlp_gait.gaits.biped.instant import PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN, FootClearance, Margins
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import Criterion, goal_of
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.gaits.biped.single_support import loads_on_left, single_support_mean_margins, swing_foot
from nlp_gait.gaits.humanoid.body import GRAVITY, Humanoid, humanoid
from nlp_gait.gaits.humanoid.problem import LEAN, humanoid_motors, lean_motion, lean_variables, parts_of, staged
from nlp_gait.robots import Foot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, stack

DURATION, LIFT = "single_support_time_s", "swing_height_m"
# Curves that can be splines; the swing foot stays on its line across the walking direction.
UNITS = dict.fromkeys((*HIP_CURVES, "foot_x", "foot_z"), "m") | dict.fromkeys(LEAN, "rad")


@maker
def humanoid_ssp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    step_length_m: float = 0.0,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    drive_limits: bool = True,
    motors: str = "",
) -> GaitProblem:
    """Single support; the swing foot moves by twice the step length. For the options see ``gaits.humanoid``.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.1; general legs and the free lean of the torso are this package's own.
    """
    body = humanoid(robot)
    step = body.step_length(step_length_m)
    real = humanoid_motors(motors, body)
    splines = Splines(trajectory=trajectory, units=UNITS, length_scale=body.biped.length_scale)
    foot = body.biped.model.feet["left"]

    def path(at: InstantPoint, s: SX) -> SX:
        return _swing(body, at, step, splines.motions(at, single_support_duration(at), s), 0.0, s).position

    margins = sole_margins((step, body.foot_y("left")), foot)
    phase = Phase(
        robot=real.model,
        joints=body.biped.joints,
        planned=body.biped.joints,
        variables=(*body.hip_variables, *lean_variables(), *own_variables(body), *splines.variables),
        duration=DURATION,
        plan=single_support_plan(body, step, splines),
        loads=loads_on_left(real.model, GRAVITY, body.upright_feet),
        grid=grid_for(trajectory, intervals, samples_per_interval),
        parts=(
            *parts_of(body, margins, single_support_mean_margins(foot), drive_limits=drive_limits),
            *((FootClearance(path, step, LIFT),) if splines.count else ()),
            *real.parts,
        ),
        goal=goal_of(objective, real, body.heat),
    )
    start = splines.start_of(phase.names)
    return staged("humanoid-ssp", "single support: least mean power", phase, body, start=start)


def own_variables(body: Humanoid) -> tuple[Variable, ...]:
    """Height and time of the swing."""
    return (
        Variable(
            name=LIFT,
            unit="m",
            lower=body.length(0.015),
            upper=body.length(0.03),
            description="highest point of the swing foot",
        ),
        Variable(name=DURATION, unit="s", lower=body.time(0.4), upper=body.time(4.0), description="of the phase"),
    )


def single_support_duration(at: InstantPoint) -> SX:
    """Time of the phase [s], never zero."""
    return fmax(at[DURATION], LEAST_DURATION)


def single_support_plan(body: Humanoid, step: float, splines: Splines) -> Planner:
    """The hips' middle moves from half a step behind the standing foot to half a step ahead, halfway to it across."""
    y = body.foot_y("left")

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        duration = single_support_duration(at)
        more = splines.motions(at, duration, phase)
        hip = hip_on_spline(at, more, (step / 2, 1.5 * step), (y / 2, y / 2), duration, phase)
        ankles = {
            "L": stack(*map(constant_motion, (step, y, body.ankle_height("left")))),
            "R": _swing(body, at, step, more, body.ankle_height("right"), phase),
        }
        return body.plan(hip, lean_motion(at, more, duration, phase), ankles, at[REACH_MARGIN], ops)

    return plan


def _swing(
    body: Humanoid, at: InstantPoint, step: float, more: Mapping[str, Motion], ankle_height: float, phase: SX
) -> Motion:
    """Motion of the right foot's origin (3,) [m]: a cubic forward, a parabola up, and what its curves add."""
    ends, duration = (SX(0.0), SX(2 * step)), single_support_duration(at)
    swing = swing_foot(*ends, body.foot_y("right"), ankle_height, at[LIFT], duration, phase)
    return add_motions(swing, stack(more["foot_x"], constant_motion(0.0), more["foot_z"]))


def sole_margins(support_xy: tuple[float, float], foot: Foot) -> Margins:
    """Distances of the ZMP to the nearer edges of one sole in x and in y; NAO's published ones jump at the ankle in x."""

    def margins(zmp: MX, at: Point, ops: Nonsmooth) -> tuple[MX, MX]:
        x, y = (zmp[0, :] - support_xy[0]).T, (zmp[1, :] - support_xy[1]).T
        along = ops.min(foot.front_m - x, x + foot.back_m)
        return along.T, ops.min(foot.left_m - y, y + foot.right_m).T

    return margins
