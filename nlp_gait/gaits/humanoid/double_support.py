"""Double support of any humanoid: least mean power while the weight passes from foot to foot (after section 4.2)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Literal

from casadi import SX, fmax

from nlp_gait.formulation import GaitProblem, InstantPoint, Variable, maker
from nlp_gait.gaits.biped.curves import HIP_CURVES, Splines, Trajectory, grid_for, hip_on_spline
from nlp_gait.gaits.biped.double_support import (
    LOAD_DEGREE,
    Point2,
    Standing,
    double_support_margins,
    double_support_mean_margins,
    support_box,
)
from nlp_gait.gaits.biped.instant import PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import REACH_MARGIN
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import Criterion, goal_of
from nlp_gait.gaits.biped.samples import LEAST_DURATION
from nlp_gait.gaits.humanoid.body import GRAVITY, LETTERS, Humanoid, humanoid
from nlp_gait.gaits.humanoid.problem import LEAN, humanoid_motors, lean_motion, lean_variables, parts_of, staged
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import constant_motion, stack

DURATION = "double_support_time_s"
UNITS = dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(LEAN, "rad")

Share = Literal["lever", "free"]


@maker
def humanoid_dsp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    torso_share: Share = "lever",
    step_length_m: float = 0.0,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    drive_limits: bool = True,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Double support, the right foot a step ahead; for the options see ``gaits.humanoid``.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.2; general legs and the free lean of the torso are this package's own.
    """
    body = humanoid(robot)
    step = body.step_length(step_length_m)
    real = humanoid_motors(motors, body)
    left, right = body.feet_y
    soles = {"L": (step, left), "R": (2 * step, right)}
    box = support_box(real.model, soles)
    splines = Splines(trajectory=trajectory, units=UNITS, length_scale=body.biped.length_scale)
    sharing = standing(body, real.model).sharing(torso_share, load_degree)
    own = (
        Variable(name=DURATION, unit="s", lower=body.time(0.2), upper=body.time(2.0), description="of the phase"),
        *splines.variables,
        *sharing.variables,
    )
    phase = Phase(
        robot=real.model,
        joints=body.biped.joints,
        planned=body.biped.joints,
        variables=(*body.hip_variables, *lean_variables(), *own),
        duration=DURATION,
        plan=sharing.planned(_planner(body, soles, splines)),
        loads=sharing.loads,
        grid=grid_for(trajectory, intervals, samples_per_interval, planned_loads=torso_share == "free"),
        parts=(
            *parts_of(body, double_support_margins(box), double_support_mean_margins(box), drive_limits=drive_limits),
            *real.parts,
            *sharing.parts,
        ),
        goal=goal_of(objective, real, body.heat),
    )
    return staged(
        "humanoid-dsp",
        "double support: least mean power",
        phase,
        body,
        start=sharing.start_of(phase.names, splines.start_of(phase.names)),
    )


def standing(body: Humanoid, model: Robot, upright: Collection[str] | None = None) -> Standing:
    """A humanoid on both feet.

    Args:
        body: the humanoid.
        model: its body, perhaps with the inertia of its rotors.
        upright: links that never turn; None for flat soles.
    """
    return Standing(
        robot=model,
        halves={LETTERS[side]: leg.joints for side, leg in body.biped.legs.items()},
        feet_y=body.feet_y,
        gravity=GRAVITY,
        upright=body.upright_feet if upright is None else upright,
    )


def double_support_duration(at: InstantPoint) -> SX:
    """Time of the phase [s], never zero."""
    return fmax(at[DURATION], LEAST_DURATION)


def _planner(body: Humanoid, soles: Mapping[str, Point2], splines: Splines) -> Planner:
    """The hips' middle moves from a sixth of a step ahead of the rear foot to a sixth behind the front one."""
    ankles = {
        LETTERS[side]: stack(*map(constant_motion, (*soles[LETTERS[side]], body.ankle_height(side))))
        for side in ("left", "right")
    }
    (rear_x, left_y), (front_x, right_y) = soles["L"], soles["R"]
    sixth = (front_x - rear_x) / 6

    def plan(at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        duration = double_support_duration(at)
        more = splines.motions(at, duration, phase)
        ends = (rear_x + sixth, front_x - sixth), (left_y / 2, right_y / 2)
        hip = hip_on_spline(at, more, *ends, duration, phase)
        return body.plan(hip, lean_motion(at, more, duration, phase), ankles, at[REACH_MARGIN], ops)

    return plan
