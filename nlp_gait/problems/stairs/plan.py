"""Planning one step on stairs: the governing parameters that cost least energy or joint jerk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError
from nlp_gait.problem import (
    Array,
    Assembly,
    GaitProblem,
    Grid,
    NumericPoint,
    Objective,
    Parameter,
    Point,
    Signals,
    Variable,
    maker,
)
from nlp_gait.problems.stairs.formulas.gait import PHASES
from nlp_gait.problems.stairs.formulas.loads import JOINT_RATES, JOINTS
from nlp_gait.problems.stairs.governing import GIVEN_PARAMETERS, GOVERNING_VARIABLES, REACH_MARGIN
from nlp_gait.problems.stairs.plan_rows import clearance_rows, ground_rows, phase_rows, posture_rows
from nlp_gait.problems.stairs.plan_samples import PlannedStep, Samples
from nlp_gait.problems.stairs.robot import toe_foot_biped
from nlp_gait.problems.stairs.skeleton import skeleton
from nlp_gait.problems.stairs.stair import COLUMNS, STAIR_PARAMETERS, joint_signals
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

Minimise = Literal["energy", "jerk"]
OBJECTIVES = {
    "energy": Objective(name="energy", unit="J"),
    "jerk": Objective(name="peak_joint_jerk", unit="rad/s^3"),
}

VARIABLES = (
    *GOVERNING_VARIABLES,
    Variable(
        name="rear_share",
        unit="1",
        lower=0.0,
        upper=0.95,
        description="share of the ground force below the rear toe at the start",
    ),
)
# Start points scatter about a plan that is plausible on common stairs (normal, in units of the ranges): from uniform ones
# half of all runs of IPOPT end at unreachable poses.
PLAUSIBLE = (0.67, 0.09, 0.25, 0.08, 1.0, 1.4, 0.5, 1.0, 1.8, 0.35, 0.2)
SCATTER = 0.1

PARAMETERS = (
    *STAIR_PARAMETERS,
    *GIVEN_PARAMETERS,
    REACH_MARGIN,
    Parameter(
        name="zmp_margin_m",
        unit="m",
        default=0.01,
        description="least distance of the stance foot's ZMP from its ends",
        minimum=0.0,
        maximum=0.08,
    ),
    Parameter(
        name="least_stance_force_N", unit="N", default=20.0, description="least load of the stance foot", minimum=0.0
    ),
    Parameter(name="friction", unit="1", default=0.6, description="mu below both feet", minimum=0.0),
    Parameter(
        name="clearance_m", unit="m", default=0.002, description="least height of the swing foot above the stair"
    ),
    Parameter(
        name="acceleration_limit_rad_s2",
        unit="rad/s^2",
        default=80.0,
        description="largest acceleration of a link",
        minimum=0.0,
    ),
    Parameter(name="least_phase_s", unit="s", default=0.1, description="least duration of each phase", minimum=0.0),
    Parameter(
        name="quantum_s",
        unit="s",
        default=0.01,
        description="time in which the acceleration may jump from phase to phase, for the jerk (eq. 43)",
        minimum=1e-4,
    ),
)


@maker()
def stairs_plan(*, minimise: Minimise = "energy", intervals: int = 40) -> GaitProblem:
    """Planner of one step.

    Args:
        minimise: energy, the integral of sum |torque x rate| over all joints, or the peak of the joints' jerk (the paper's
            knot shifting).
        intervals: of the step, a quarter in each phase.

    Raises:
        InputError: an option that is not allowed.

    Source:
        Bhardwaj et al., section V and Table III.
    """
    if isinstance(intervals, bool) or not isinstance(intervals, int) or intervals < 4 or intervals % len(PHASES):
        raise InputError(f"intervals must be a multiple of {len(PHASES)} (one part for each phase), got {intervals!r}")
    step = PlannedStep(per_phase=intervals // len(PHASES))

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        return _assemble(point, step, minimise, ops)

    def motion(at: NumericPoint) -> Signals:
        samples = step.samples(at, Exact())
        arrays = {name: np.array(ca.evalf(value)).T for name, value in samples._asdict().items()}
        moving = joint_signals(*(arrays.pop(name) for name in ("q", "qd", "qdd")))
        renamed = {"t": arrays.pop("time")[:, 0], "tau": arrays.pop("torque")}
        return Signals(joints=JOINTS, arrays={**renamed, **moving, **arrays}, columns=COLUMNS)

    return GaitProblem(
        name="stairs-plan",
        title="Stairs, planned step: least energy or jerk",
        variables=VARIABLES,
        own_parameters=PARAMETERS,
        objective=OBJECTIVES[minimise],
        assemble=assemble,
        start=_start,
        hessian="limited-memory",
        grid=Grid(intervals=intervals, refined_by="intervals"),
        motion=motion,
        skeleton=skeleton,
    )


def _assemble(point: Point, step: PlannedStep, minimise: Minimise, ops: Nonsmooth) -> Assembly:
    samples = step.samples(point, ops)
    jerk = _jerk(samples, step.per_phase, point["quantum_s"])
    exact = Exact()
    pressure = samples.stance_pressure.T
    return Assembly(
        objective=_energy(samples, step.per_phase, ops) if minimise == "energy" else ops.largest(jerk),
        constraints=(
            *posture_rows(point, samples),
            *ground_rows(point, samples),
            clearance_rows(point, step, ops),
            phase_rows(point),
        ),
        indexes={
            "energy_J": _energy(samples, step.per_phase, exact),
            "peak_jerk_rad_s3": exact.largest(jerk),
            "peak_acceleration_rad_s2": exact.largest(ca.vec(_joints(samples.qdd))),
            "peak_torque_Nm": exact.largest(ca.vec(samples.torque)),
            "zmp_margin_min_m": ca.mmin(exact.min(pressure, toe_foot_biped().foot_m - pressure)),
        },
    )


def _start(_: Mapping[str, float], rng: np.random.Generator) -> Array:
    ranges = np.array([variable.upper - variable.lower for variable in VARIABLES])
    return np.array(PLAUSIBLE) + SCATTER * ranges * rng.standard_normal(len(VARIABLES))


def _joints(links: MX) -> MX:
    """Derivatives of joint angles from those of link angles."""
    return DM(JOINT_RATES) @ links


def _energy(samples: Samples, per_phase: int, ops: Nonsmooth) -> MX:
    """Integral of sum |torque x rate| by the trapezoidal rule, phase by phase [J]."""
    power = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    total = MX(0)
    for first in _phase_starts(per_phase):
        durations = samples.time[first + per_phase] - samples.time[first]
        ends = power[:, first] + power[:, first + per_phase]
        inner = power[:, first : first + per_phase + 1]
        total += durations / per_phase * (ca.sum1(ca.sum2(inner)) - ca.sum1(ends) / 2)
    return total


def _jerk(samples: Samples, per_phase: int, quantum: MX) -> MX:
    """Joint jerk between consecutive samples as a column [rad/s^3]; a jump between phases takes one quantum of time."""
    change = _joints(samples.qdd[:, 1:] - samples.qdd[:, :-1])
    starts = _phase_starts(per_phase)
    columns = []
    for k in range(change.shape[1]):
        jump = k + 1 in starts
        duration = quantum if jump else samples.time[k + 1] - samples.time[k]
        columns.append(change[:, k] / duration)
    return ca.vertcat(*columns)


def _phase_starts(per_phase: int) -> tuple[int, ...]:
    """Number of the first sample of each phase."""
    return tuple(i * (per_phase + 1) for i in range(len(PHASES)))
