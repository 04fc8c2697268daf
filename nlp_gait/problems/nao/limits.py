"""Problem of a NAO support phase (sections 4.1 and 4.2): parameters, objective, constraints, indexes from its samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.problem.gait_problem import (
    Array,
    Assembly,
    Constraint,
    GaitProblem,
    Objective,
    Parameter,
    Point,
    Signals,
    Variable,
)
from nlp_gait.problems.nao.body import JOINTS, PLANNED_JOINTS
from nlp_gait.problems.nao.phase import Phase, Samples
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Violations that count alike in the total: 1 rad, 1 Nm, 10 mm of balance margin, 1 in the cosine of a knee.
ANGLE_SCALE, TORQUE_SCALE, MARGIN_SCALE, REACH_SCALE = 1.0, 1.0, 0.01, 1.0

# Balance margins in x and y, (1, N + 1) each [m], from the ZMP (2, N + 1) [m] and an interpretation.
Margins = Callable[[MX, Nonsmooth], tuple[MX, MX]]


def phase_problem(
    *,
    name: str,
    title: str,
    variables: tuple[Variable, ...],
    phase: Phase,
    margins: Margins,
    mean_dbm_m: tuple[float, float],
    make: Callable[..., GaitProblem],
    options: Mapping[str, str | int | float | bool],
) -> GaitProblem:
    """Least mean power over a phase.

    Args:
        name: of the problem.
        title: one line.
        variables: in the order of x.
        phase: motion and loads, sampled.
        margins: balance margins of the phase's ground contact.
        mean_dbm_m: default of the least mean balance margins in x and y [m].
        make: the function that made this problem, called again for a denser grid.
        options: that it was called with.
    """

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        samples = phase.samples(point, ops)
        return assemble_phase(point, ops, samples, margins(samples.zmp, ops), phase.samples_per_interval)

    def refine(factor: int) -> GaitProblem:
        return make(**{**options, "samples_per_interval": phase.samples_per_interval * factor})

    def signals(x: Array, p: Array) -> Signals:
        return phase.signals(problem.symbols(), x, p)

    problem = GaitProblem(
        name=name,
        title=title,
        options=options,
        variables=variables,
        own_parameters=phase_parameters(phase.robot, mean_dbm_m),
        objective=Objective(name="power", unit="W"),
        assemble=assemble,
        refine=refine,
        signals=signals,
    )
    return problem


def phase_parameters(robot: Robot, mean_dbm_m: tuple[float, float]) -> tuple[Parameter, ...]:
    """Limits and weights of a phase; ``mean_dbm_m`` holds the least mean balance margins in x and y [m]."""
    limits = [
        Parameter(
            name=f"{joint}_rad.{end}",
            unit="rad",
            default=robot.joint(joint).planning_limits_rad[side],
            description=f"{end} limit of {joint}",
        )
        for joint in PLANNED_JOINTS
        for side, end in enumerate(("lower", "upper"))
    ]
    return (
        Parameter(
            name="heat_loss_W_per_Nm2", unit="W/(Nm)^2", default=0.025, description="K, heat loss (eq. 32)", minimum=0.0
        ),
        Parameter(
            name="torque_change_limit_Nm",
            unit="Nm",
            default=1.2,
            description="largest change of a torque over one interval",
            minimum=0.0,
        ),
        Parameter(name="dbm_x_min_limit_m", unit="m", default=0.0, description="least balance margin in x"),
        Parameter(name="dbm_y_min_limit_m", unit="m", default=0.0, description="least balance margin in y"),
        Parameter(name="dbm_x_mean_limit_m", unit="m", default=mean_dbm_m[0], description="least mean margin in x"),
        Parameter(name="dbm_y_mean_limit_m", unit="m", default=mean_dbm_m[1], description="least mean margin in y"),
        Parameter(
            name="reach_margin",
            unit="1",
            default=0.01,
            description="distance of a knee's cosine from +-1: 0.01 keeps it bent by 0.14 rad",
            minimum=0.0,
            maximum=0.5,
        ),
        *limits,
    )


def assemble_phase(
    point: Point, ops: Nonsmooth, samples: Samples, dbm: tuple[MX, MX], samples_per_interval: int
) -> Assembly:
    """Objective, constraints and indexes of a phase.

    Args:
        point: symbols.
        ops: interpretation.
        samples: the phase, N + 1 columns.
        dbm: balance margins in x and y, (1, N + 1) each [m].
        samples_per_interval: samples between the two torques whose difference is a torque change.
    """
    n = samples.torque.shape[1]
    power = _mean_power(point, ops, samples)
    step = samples_per_interval
    change = samples.torque[:, step:] - samples.torque[:, :-step]
    change_limit = point["torque_change_limit_Nm"]
    at_samples = [str(k) for k in range(n)]
    dbm_x, dbm_y = dbm
    lower, upper = (ca.vertcat(*(point[f"{j}_rad.{end}"] for j in PLANNED_JOINTS)) for end in ("lower", "upper"))
    reach_limit = 1 - point["reach_margin"]
    constraints = (
        Constraint(
            name="joint_angle",
            labels=labels(PLANNED_JOINTS, at_samples),
            unit="rad",
            scale=ANGLE_SCALE,
            value=ca.vec(samples.planned),
            lower=ca.repmat(lower, n, 1),
            upper=ca.repmat(upper, n, 1),
        ),
        Constraint(
            name="reach",
            labels=labels(("left leg", "right leg"), at_samples),
            unit="1",
            scale=REACH_SCALE,
            value=ca.vec(samples.reach),
            lower=-reach_limit,
            upper=reach_limit,
        ),
        Constraint(
            name="torque_change",
            labels=labels(JOINTS, [str(k) for k in range(n - step)]),
            unit="Nm",
            scale=TORQUE_SCALE,
            value=ca.vec(change),
            lower=-change_limit,
            upper=change_limit,
        ),
        *(
            Constraint(
                name=f"dbm_{axis}",
                labels=tuple(at_samples),
                unit="m",
                scale=MARGIN_SCALE,
                value=margin.T,
                lower=point[f"dbm_{axis}_min_limit_m"],
            )
            for axis, margin in (("x", dbm_x), ("y", dbm_y))
        ),
        *(
            Constraint(
                name=f"dbm_{axis}_mean",
                unit="m",
                scale=MARGIN_SCALE,
                value=ca.sum2(margin) / n,
                lower=point[f"dbm_{axis}_mean_limit_m"],
            )
            for axis, margin in (("x", dbm_x), ("y", dbm_y))
        ),
    )
    indexes = {
        "power_W": power,
        "torque_change_Nm": ca.mmax(ca.fabs(change)),
        "dbm_x_min_m": ca.mmin(dbm_x),
        "dbm_y_min_m": ca.mmin(dbm_y),
        "dbm_x_mean_m": ca.sum2(dbm_x) / n,
        "dbm_y_mean_m": ca.sum2(dbm_y) / n,
    }
    return Assembly(objective=power, constraints=constraints, indexes=indexes)


def _mean_power(point: Point, ops: Nonsmooth, samples: Samples) -> MX:
    """Mean electrical power by the trapezoidal rule [W] (eq. 32)."""
    mechanical = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    heat = point["heat_loss_W_per_Nm2"] * ca.sum1(samples.torque**2)
    return time_mean(ca.sum1(mechanical) + heat)


def time_mean(values: MX) -> MX:
    """Means of rows (m, N + 1) over equidistant samples by the trapezoidal rule."""
    n = values.shape[1]
    weights = np.full(n, 1.0 / (n - 1))
    weights[[0, -1]] /= 2
    return values @ DM(weights)


def labels(rows: tuple[str, ...], columns: list[str]) -> tuple[str, ...]:
    """Labels of a column-major matrix."""
    return tuple(f"{row}, {column}" for column in columns for row in rows)
