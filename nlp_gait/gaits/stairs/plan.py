"""Planning one step on stairs: the governing parameters that cost least energy or joint jerk."""

from collections.abc import Mapping
from functools import partial
from math import inf
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Assembly, Constraint, Display, GaitProblem, Grid, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import (
    NumericPoint,
    Objective,
    Point,
    RowsOverTime,
    Variable,
    make_parameters,
)
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.display import (
    StepMotion,
    compute_ground_force,
    make_simulation_model,
    make_skeleton,
    make_standing_step,
)
from nlp_gait.gaits.stairs.plan_samples import (
    GROUND_SHARE,
    BalanceRule,
    PlannedStep,
    PlanSamples,
    make_grid_at,
    make_reach_function,
)
from nlp_gait.gaits.stairs.planar_biped import JOINT_RATES, JOINTS, MOVING, load_toe_foot_biped
from nlp_gait.gaits.stairs.planned_motion import PHASES
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

Minimise = Literal["energy", "jerk"]
Shanks = Literal["free", "limited"]
OBJECTIVES = {
    "energy": Objective(name="energy", unit="J"),
    "jerk": Objective(name="peak_joint_jerk", unit="rad/s^3"),
}

REAR_SHARE = "share of the ground force below the rear toe at the start"
VARIABLES = (
    *stair.GOVERNING_VARIABLES,
    Variable(name="rear_share", unit="1", lower=0.0, upper=0.95, description=REAR_SHARE),
)
# Start points are normally distributed around a plausible plan for common stairs, in units of the ranges: from uniform points
# half of all runs of IPOPT end at unreachable poses. Of two optima, the better one catches the cycloid early (t_bc at 1.0 to
# 1.4 s on the stairs of Table IV, instead of 2.7 to 2.8 s), as the starts do.
PLAUSIBLE = (0.67, 0.09, 0.25, 0.08, 1.0, 1.4, 0.5, 1.0, 1.4, 0.35, 0.2)
SCATTER = 0.1
DRAWS = 100
PARTS_AT_START = 10  # of each phase, at which the legs of a start point reach
# Between samples an edge may be nearer than at them; the difference falls with the square of their distance. This divided by
# the square of the number of intervals in a phase is kept in reserve [m]: a millimetre on the usual grid.
SAMPLING_RESERVE = 0.1

PHASE_ENDS = ("t1_s", "t2_s", "t_bc_s", "t3_s")

FINE_INTERVALS = 250  # of each phase of a simulated gait

PARAMETERS = (
    *stair.STAIR_PARAMETERS,
    *stair.GIVEN_PARAMETERS,
    *make_parameters(
        stair.REACH_MARGIN,
        ("zmp_margin_m", "m", 0.01, "least distance of the stance foot's ZMP from its ends", 0.0, 0.08),
        stair.LEAST_STANCE_FORCE,
        ("friction", "1", 0.6, "mu below both feet", 0.0, inf),
        ("clearance_m", "m", 0.002, "least height of the swing foot above the stair", -inf, inf),
        ("acceleration_limit_rad_s2", "rad/s^2", 80.0, "largest acceleration of a link", 0.0, inf),
        ("least_phase_s", "s", 0.1, "least duration of each phase", 0.0, inf),
        ("quantum_s", "s", 0.01, "time of a jump in acceleration between phases, for the jerk (eq. 43)", 1e-4, inf),
    ),
)


@maker
def stairs_plan(
    *,
    minimise: Minimise = "energy",
    balance: BalanceRule = "feet",
    angle_limits: bool = True,
    shanks: Shanks = "free",
    intervals: int = 40,
) -> GaitProblem:
    """Return the planner of one step.

    Args:
        minimise: energy, the integral of sum |torque x rate| over all joints; jerk, the peak of the joints' jerk (the paper's
            knot shifting).
        balance: feet, the centre of pressure below the stance foot; polygon, as printed, the ZMP of (49) in the convex hull of
            the contact points.
        angle_limits: whether angles of links and knees are limited; the paper gives no limits.
        shanks: free, as printed, or limited: both shanks stay outside the steps.
        intervals: of the step, a quarter in each phase.

    Source:
        Bhardwaj et al., section V and Table III.
    """
    if intervals < len(PHASES) or intervals % len(PHASES):
        raise InputError(f"intervals must be a multiple of {len(PHASES)} (one part for each phase), got {intervals!r}")
    planned = PlannedStep(
        phase_grid=Grid(intervals=intervals // len(PHASES)),
        balance=balance,
        angle_limits=angle_limits,
        shank_limits=shanks == "limited",
    )
    variables = VARIABLES if balance == "feet" else stair.GOVERNING_VARIABLES

    model = make_simulation_model(_simulate) if balance == "feet" else None
    return GaitProblem(
        name="stairs-plan",
        title="Stairs, planned step: least energy or jerk",
        variables=variables,
        own_parameters=PARAMETERS,
        objective=OBJECTIVES[minimise],
        assemble=partial(_assemble, planned, minimise),
        grid=Grid(intervals=intervals, refined_by="intervals"),
        display=Display(motion=partial(_compute_signals, planned), skeleton=make_skeleton, simulation_model=model),
        hints=SolverHints(start=partial(_start, variables)),
        rows_over_time=tuple(
            RowsOverTime(
                name=name,
                assemble=partial(_assemble_phase, planned, i),
                times=partial(_find_phase_times, i),
                means=("energy_J",),
            )
            for i, name in enumerate(PHASES)
        ),
    )


def _compute_signals(planned: PlannedStep, point: NumericPoint) -> Signals:
    samples = planned.samples(point, Exact())
    arrays = {name: np.array(ca.evalf(value)).T for name, value in samples._asdict().items()}
    for name in ("q", "qd", "qdd"):
        arrays[f"link_{name}"] = arrays[name]
        arrays[name] = arrays[name] @ JOINT_RATES.T
    arrays |= {"t": arrays.pop("time")[:, 0], "tau": arrays.pop("torque")}
    return Signals(joints=JOINTS, arrays=arrays, columns=stair.COLUMNS)


def _simulate(point: NumericPoint) -> StepMotion:
    fine = PlannedStep(phase_grid=Grid(intervals=FINE_INTERVALS)).samples(point, Exact())
    t, q, qd, qdd, stance = (
        np.array(ca.evalf(values)).T for values in (fine.time, fine.q, fine.qd, fine.qdd, fine.stance_force)
    )
    new = np.diff(t[:, 0], prepend=-1.0) > 0.0  # where phases meet, the end of the earlier one
    t, q, qd, qdd, stance = (values[new] for values in (t, q, qd, qdd, stance))
    toe = compute_ground_force(q, qd, qdd) - stance
    return make_standing_step(t[:, 0], q, qd, qdd, toe, np.zeros_like(toe), float(point["t2_s"]))


def _find_phase_times(phase: int, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the start and end of a phase [s]; the step begins at zero."""
    start, end = [0.0, *(values[name] for name in PHASE_ENDS)][phase : phase + 2]
    return start, end


def _assemble_phase(step: PlannedStep, phase: int, point: Point, fractions: MX, ops: Nonsmooth) -> Assembly:
    """Return the rows of one phase at fractions (1, k) of it; clearance has no reserve for the motion between samples here."""
    grid = make_grid_at(phase, fractions)
    samples = step.samples(point, ops, grid)
    start, end = [MX(0), *(point[name] for name in PHASE_ENDS)][phase : phase + 2]
    share = {2: lambda s: GROUND_SHARE + (1 - GROUND_SHARE) * s, 3: lambda s: (1 - GROUND_SHARE) * s}.get(phase)
    clear: tuple[Constraint, ...] = ()
    if share is not None:
        heights = step.clearances(point, ops, make_grid_at(phase, share(fractions)))
        clear = (_limit_clearance(heights, point["clearance_m"]),)
    if step.shank_limits:
        clear = (*clear, stair.limit_shanks(step.shank_gaps(point, ops, grid), "next"))
    energy = (end - start) * ca.sum1(ca.sum2(ca.fabs(samples.power))) / fractions.shape[1]
    return Assembly(
        objective=energy, constraints=(*_make_rows_at(point, samples, step), *clear), metrics={"energy_J": energy}
    )


def _limit_clearance(heights: MX, least: MX) -> Constraint:
    return stair.make_rows("clearance", heights, ("toe", "sole", "ankle"), "m", 0.01, lower=least)


def _make_rows_at(point: Point, samples: PlanSamples, step: PlannedStep) -> tuple[Constraint, ...]:
    """Return rows of reach, link angles, knees, accelerations and ground at every sample."""
    m = samples.q.shape[1]
    lower, upper = (MX(DM([stair.ANGLE_LIMITS[link][i] for link in MOVING] * m)) for i in range(2))
    most = point["acceleration_limit_rad_s2"]
    links = stair.make_rows("link_angle", samples.q, MOVING, "rad", 0.1, lower=lower, upper=upper)
    if step.balance == "feet":
        balance = stair.limit_stance_zmp(point, samples.stance_pressure)
    else:  # the ZMP of (49) between the outer contact points
        rear, front = ca.vertsplit(samples.support)
        ahead = ca.vertcat(samples.zmp - rear, front - samples.zmp)
        balance = stair.make_rows("zmp", ahead, ("rear", "front"), "m", 0.01, lower=point["zmp_margin_m"])
    return (
        stair.make_rows("reach", samples.reach, ("swing", "stance"), "1", 0.1, upper=1 - point["reach_margin"]),
        *((links, stair.limit_knees("knee_angle", samples.q)) if step.angle_limits else ()),
        stair.make_rows("link_acceleration", samples.qdd, MOVING, "rad/s^2", 10.0, lower=-most, upper=most),
        stair.limit_stance_load(point, samples.stance_force),
        stair.limit_grip("friction", samples.stance_force, point["friction"]),
        balance,
    )


def _assemble(step: PlannedStep, minimise: Minimise, point: Point, ops: Nonsmooth) -> Assembly:
    samples = step.samples(point, ops)
    jerk = step.jerk(samples, point["quantum_s"])
    exact = Exact()
    pressure, rear, front = samples.stance_pressure.T, MX(0), MX(load_toe_foot_biped().foot_m)
    if step.balance == "polygon":
        pressure, rear, front = samples.zmp.T, samples.support[0, :].T, samples.support[1, :].T
    least_clearance = point["clearance_m"] + SAMPLING_RESERVE / step.per_phase**2
    ends = ca.vertcat(0, *(point[name] for name in PHASE_ENDS))
    durations, least = ends[1:] - ends[:-1], point["least_phase_s"]
    return Assembly(
        objective=step.energy(samples, ops) if minimise == "energy" else ops.largest(jerk),
        constraints=(
            *_make_rows_at(point, samples, step),
            _limit_clearance(step.clearances(point, ops), least_clearance),
            *((stair.limit_shanks(step.shank_gaps(point, ops), "next"),) if step.shank_limits else ()),
            Constraint(name="phase_duration", labels=PHASES, unit="s", scale=0.1, value=durations, lower=least),
        ),
        metrics={
            "energy_J": step.energy(samples, exact),
            "peak_jerk_rad_s3": exact.largest(jerk),
            "peak_acceleration_rad_s2": exact.largest(ca.vec(DM(JOINT_RATES) @ samples.qdd)),
            "peak_torque_Nm": exact.largest(ca.vec(samples.torque)),
            "zmp_margin_min_m": ca.mmin(exact.min(pressure - rear, front - pressure)),
        },
    )


def _start(variables: tuple[Variable, ...], parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Draw a point around the plausible plan, again until every phase has a duration and the legs reach."""
    ranges = np.array([variable.upper - variable.lower for variable in variables])
    tread = parameters["stair_length_m"] / 2
    size, margin = [tread, parameters["rise_run_ratio"] * tread], parameters[stair.REACH_MARGIN[0]]
    given = [parameters[parameter.name] for parameter in stair.GIVEN_PARAMETERS]
    lower, upper = (np.array([parameters[f"{v.name}.{end}"] for v in variables]) for end in ("lower", "upper"))
    about = np.array(PLAUSIBLE[: len(variables)])
    best, least = np.empty(0), inf
    for _ in range(DRAWS):
        x = np.clip(about + SCATTER * ranges * rng.standard_normal(len(variables)), lower, upper)
        plan = np.concatenate([x[: len(stair.GOVERNING_VARIABLES)], given])
        named = dict(zip(stair.GOVERNING, plan, strict=True))
        durations = np.diff([0.0, *(named[name] for name in PHASE_ENDS)])
        out_of_reach = np.array(make_reach_function(PARTS_AT_START)(plan, size, margin)) - (1 - margin)
        too_short = parameters["least_phase_s"] - durations
        violation = float(np.maximum(too_short, 0.0).sum() + np.maximum(out_of_reach, 0.0).sum())
        if not best.size or violation < least:
            best, least = x, violation
        if least == 0.0:
            break
    return best
