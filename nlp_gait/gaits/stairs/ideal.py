"""Climbing one step at least effort: full trajectory optimisation."""

import math
from collections.abc import Mapping
from functools import cache, partial
from math import inf

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import InputError, check_count
from nlp_gait.formulation import Array, Display, GaitProblem, Grid, NumericPoint, Objective, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import parameters
from nlp_gait.formulation.blocks import Block, Layout
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.display import StepMotion, make_standing_step, simulation_model, skeleton
from nlp_gait.gaits.stairs.ideal_model import AXES, Ends, IdealModel
from nlp_gait.gaits.stairs.planar_biped import JOINTS, MOVING
from nlp_gait.gaits.stairs.planned_motion import Stair, StairPlan, posture
from nlp_gait.symbolic.nonsmooth import Exact

RATE_LIMIT, ACCELERATION_LIMIT = 12.0, 80.0  # [rad/s], [rad/s^2]
FORCE_LIMITS = ((-600.0, 600.0), (0.0, 900.0))  # of the ground on a point of the rear foot, along x and z [N]
STEP_TIME = 3.5  # t3, for which the times of the rear foot are given (Table III) [s]
# A start point: noise on the link angles [rad], and the rear foot's share of the load [N].
NOISE, TOE_LOAD, SOLE_LOAD = 0.02, 250.0, 100.0
# A plan whose legs reach on common stairs; neither optimal nor balanced.
PLAN = {
    "hip_height": 0.66,
    "zmp_start": 0.18,
    "zmp_end": 0.05,
    "end_rate": 2.0,
    "torso_pitch": 1.35,
    "foot_pitch": 0.0,
    "sole_angle": np.pi / 6,
    "toe_angle": np.pi / 6,
    "catch_angle": 0.01,
    **dict(zip(("t1", "t2", "t_bc", "t3"), stair.PAPER_TIMES, strict=True)),
}
HIP_BEHIND = 0.08  # of the hip at the start, from the middle of the rear tread [m]
REACH_MARGIN = 0.02  # on the cosine of a knee: avoids stretched legs at the start
FINE_INTERVALS = 1000  # of a simulated gait

PARAMETERS = (
    *stair.STAIR_PARAMETERS,
    *parameters(
        ("step_time_s", "s", 3.5, "t3, time of the step", 0.1, inf),
        ("torque_weight", "1/(N m)^2/s", 0.01, "cost of squared torque", 0.0, inf),
        ("acceleration_weight", "s^3/rad^2", 1e-3, "cost of squared link acceleration", 0.0, inf),
        ("friction", "1", 0.6, "mu below the rear foot", 0.0, inf),
        ("stance_friction", "1", 10.0, "mu below the stance foot; the default does not bind", 0.0, inf),
        stair.LEAST_STANCE_FORCE,
        ("zmp_margin_m", "m", 0.0, "least distance of the stance foot's ZMP from its ends", 0.0, 0.08),
        ("clearance_m", "m", -0.002, "least height of foot points above the smoothed stair", -inf, inf),
    ),
)


@maker
def stairs_ideal(
    *, ends: Ends = "rest", sole_off_s: float = 0.5, toe_off_s: float = 1.4, intervals: int = 70
) -> GaitProblem:
    """Return the trajectory optimisation of one step.

    States are angles and rates of the seven links that move while the stance foot stands flat; controls are their
    accelerations and the ground's forces on sole and toe of the rear foot.

    Args:
        ends: rest, both ends at rest on flat feet; moving, any rates at the ends and a landing on the toe, as in a planned step.
        sole_off_s: time at which the rear sole lifts, in a step of 3.5 s; in others in proportion.
        toe_off_s: time at which the rear toe lifts.
        intervals: equal parts of the step, at least 10.

    Source:
        Robot, stair and phases of Bhardwaj et al.; the formulation is this package's own.
    """
    intervals = check_count("intervals", intervals, at_least=10)
    if not 0 < sole_off_s < toe_off_s < STEP_TIME:
        raise InputError(f"times must satisfy 0 < sole_off_s < toe_off_s < {STEP_TIME}, got {sole_off_s}, {toe_off_s}")
    sole_off, toe_off = (max(1, round(time / STEP_TIME * intervals)) for time in (sole_off_s, toe_off_s))
    layout = _layout(intervals, sole_off, toe_off)
    model = IdealModel(layout=layout, intervals=intervals, sole_off=sole_off, toe_off=toe_off, ends=ends)

    def motion(at: NumericPoint) -> Signals:
        values = layout.values(at.x.full().ravel())
        step_time = float(at["step_time_s"])
        loads = model.loads_at(values)

        def repeat_last(columns: Array) -> Array:
            """Return values of intervals at their first instants; the last instant repeats the last interval."""
            return np.concatenate([columns, columns[:, -1:]], axis=1).T

        return Signals(
            joints=JOINTS,
            arrays={
                "t": np.linspace(0.0, step_time, intervals + 1),
                **stair.joint_signals(values["angle"].T, values["rate"].T, repeat_last(values["acceleration"])),
                "tau": repeat_last(loads.torque),
                "stance_force": repeat_last(loads.stance_force),
                "zmp": repeat_last(loads.stance_pressure)[:, 0],
            },
            columns=stair.COLUMNS,
        )

    def step_motion(at: NumericPoint) -> StepMotion:
        values = layout.values(at.x.full().ravel())
        step = float(at["step_time_s"]) / intervals
        per_interval = math.ceil(FINE_INTERVALS / intervals)
        since = np.tile(np.arange(per_interval) * step / per_interval, intervals)
        # The last instant ends the last interval.
        which = np.append(np.repeat(np.arange(intervals), per_interval), intervals - 1)
        since = np.append(since, step)[:, None]
        q, qd, qdd = (values[name].T[which] for name in ("angle", "rate", "acceleration"))

        def expand_force(name: str) -> Array:
            force = np.zeros((intervals, 2))
            force[: values[name].shape[1]] = values[name].T
            return force[which]

        return make_standing_step(
            which * step + since[:, 0],
            q + qd * since + qdd * since**2 / 2,
            qd + qdd * since,
            qdd,
            expand_force("toe_force"),
            expand_force("sole_force"),
            toe_off * step,
        )

    return GaitProblem(
        name="stairs-ideal",
        title="Stairs, full trajectory optimisation: least effort",
        variables=layout.variables,
        own_parameters=PARAMETERS,
        objective=Objective(name="effort", unit="1"),
        assemble=model.assemble,
        grid=Grid(intervals=intervals),
        display=Display(
            motion=motion, skeleton=skeleton, simulation_model=simulation_model(step_motion, repeats=ends == "rest")
        ),
        hints=SolverHints(start=partial(_start, layout, intervals), starts=3, searchable=False),
    )


def _layout(intervals: int, sole_off: int, toe_off: int) -> Layout:
    """Return the layout: angles and rates at all instants; accelerations and ground forces constant during an interval."""
    angles = tuple(stair.ANGLE_LIMITS[link] for link in MOVING)
    rates = ((-RATE_LIMIT, RATE_LIMIT),) * len(MOVING)
    accelerations = ((-ACCELERATION_LIMIT, ACCELERATION_LIMIT),) * len(MOVING)
    table = (
        ("angle", "rad", MOVING, intervals + 1, angles, "absolute angle of link"),
        ("rate", "rad/s", MOVING, intervals + 1, rates, "rate of link"),
        ("acceleration", "rad/s^2", MOVING, intervals, accelerations, "acceleration of link"),
        ("toe_force", "N", AXES, toe_off, FORCE_LIMITS, "force of the ground on the rear toe along"),
        ("sole_force", "N", AXES, sole_off, FORCE_LIMITS, "force of the ground on the rear sole along"),
    )
    return Layout(
        blocks=tuple(
            Block(quantity=quantity, unit=unit, rows=rows, columns=columns, limits=limits, description=description)
            for quantity, unit, rows, columns, limits, description in table
        )
    )


def _start(layout: Layout, intervals: int, values: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Return planned angles with noise, rates and accelerations by differences, and a share of the weight on the rear foot."""
    tread = values["stair_length_m"] / 2
    ends = np.array([0.0, *stair.PAPER_TIMES])
    times = np.linspace(0.0, ends[-1], intervals + 1)
    fractions = np.clip((times - ends[:-1, None]) / np.diff(ends)[:, None], 0.0, 1.0)
    size = np.tile([[tread], [values["rise_run_ratio"] * tread]], intervals + 1)
    angle = np.array(_angles().map(intervals + 1)(size, fractions))
    angle += NOISE * rng.standard_normal(angle.shape)
    step = values["step_time_s"] / intervals
    rate = np.gradient(angle, step, axis=1)
    blocks = {block.quantity: block for block in layout.blocks}
    return layout.join(
        {
            "angle": angle,
            "rate": rate,
            "acceleration": np.diff(rate, axis=1) / step,
            "toe_force": np.tile([[0.0], [TOE_LOAD]], blocks["toe_force"].columns),
            "sole_force": np.tile([[0.0], [SOLE_LOAD]], blocks["sole_force"].columns),
        }
    )


@cache
def _angles() -> ca.Function:
    """Function (tread and rise (2,), fractions of the phases (4,)) to link angles (7,)."""
    size, s = SX.sym("size", 2), SX.sym("s", 4)
    plan = StairPlan(hip_start=size[0] / 2 - HIP_BEHIND, **{name: SX(value) for name, value in PLAN.items()})
    found = posture(plan, Stair(size[0], size[1]), s, SX(4, 1), SX(REACH_MARGIN), Exact())
    return ca.Function("angles", [size, s], [found.q.position])
