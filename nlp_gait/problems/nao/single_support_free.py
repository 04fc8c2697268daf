"""NAO's single support with every joint free: least mean power, the floor under all plans of hip, foot and arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, Assembly, Constraint, GaitProblem, Point
from nlp_gait.problems.nao.body import nao
from nlp_gait.problems.nao.curve_limits import HEIGHT_SCALE, halfway_rows, limit_rows
from nlp_gait.problems.nao.curves import SPANS, SPLINE_SAMPLES, Splines, Trajectory
from nlp_gait.problems.nao.free_joints import OTHERS, FreeMotion, FreeSamples, free_splines, joint_coefficients
from nlp_gait.problems.nao.legs import check_step_length, hip_variables
from nlp_gait.problems.nao.limits import assemble_phase, phase_problem
from nlp_gait.problems.nao.phase import Phase
from nlp_gait.problems.nao.single_support import (
    OWN_VARIABLES,
    UNITS,
    nao_ssp,
    single_support_duration,
    single_support_loads,
    single_support_margins,
    single_support_mean_margins,
    single_support_plan,
    stance_of,
)
from nlp_gait.robots import Robot
from nlp_gait.symbolic.nonsmooth import Nonsmooth

FIT_FACTOR = 40  # samples of a planned motion, in each of its own, to which free joints are fitted


def nao_ssp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
) -> GaitProblem:
    """Single support of NAO with free joints.

    Args:
        robot: name or file of the robot.
        intervals: equal parts of the phase over which torques may change by the limit.
        trajectory: of every joint's angle.
        rotational_inertia: False takes every link as a point mass, in torques and ZMP.
        step_length_m: from foot to foot; the swing foot moves by twice as much.
        samples_per_interval: so many that the joints cannot bend between the samples; the number of samples must be odd, for one
            of them is the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    model = nao(robot, rotational_inertia)
    stance = stance_of(model, step_length_m)
    own = (*hip_variables(model), *OWN_VARIABLES)
    splines = free_splines(trajectory, len(own))
    variables = (*own, *splines.variables)
    paper = Splines(trajectory="cubic", units=UNITS, first=len(own))
    foot = model.feet["left"]
    motion = FreeMotion(
        robot=model,
        splines=splines,
        paper=single_support_plan(model, stance, paper),
        loads=single_support_loads(model, upright=()),
        support=(*stance.support_xy, foot.ankle_height_m),
        duration=single_support_duration,
    )
    phase = Phase(
        robot=model,
        variables=len(variables),
        duration="single_support_time_s",
        plan=motion.plan,
        loads=motion.loads,
        intervals=intervals,
        samples_per_interval=samples_per_interval,
        derivatives="analytic",
    )
    if phase.steps % 2:
        raise InputError(f"intervals * samples_per_interval must be even, got {phase.steps}: one sample is the middle")
    options: dict[str, str | int | float | bool] = {
        "robot": robot,
        "intervals": intervals,
        "trajectory": trajectory,
        "rotational_inertia": rotational_inertia,
        "step_length_m": step_length_m,
        "samples_per_interval": samples_per_interval,
    }
    problem = phase_problem(
        name="nao-ssp-free",
        title="NAO, single support with free joints: least mean power",
        variables=variables,
        phase=phase,
        margins=lambda zmp, ops: single_support_margins(zmp, stance.support_xy, foot, ops),
        mean_dbm_m=single_support_mean_margins(foot),
        make=nao_ssp_free,
        options=options,
    )
    inner_edge = stance.support_xy[1] - foot.right_m

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        found = motion.samples(phase, point, ops)
        margins = single_support_margins(found.samples.zmp, stance.support_xy, foot, ops)
        assembly = assemble_phase(point, ops, found.samples, margins, samples_per_interval)
        rows = free_rows(model, phase.steps, found, point, sum(stance.swing_x) / 2, inner_edge)
        return replace(assembly, constraints=(*assembly.constraints, *rows))

    def start(p: Array, rng: np.random.Generator) -> Array:
        """The paper's motion, for random values of its variables."""
        n = len(variables)
        x = rng.uniform(p[-2 * n : -n][: len(own)], p[-n:][: len(own)])
        return fitted_start(trajectory, planned(), x)

    @cache
    def planned() -> GaitProblem:
        return nao_ssp(robot=robot, rotational_inertia=rotational_inertia, step_length_m=step_length_m)

    return replace(problem, assemble=assemble, start=start, searchable=False)


def fitted_start(trajectory: Trajectory, planned: GaitProblem, x: Array) -> Array:
    """Start point (n,) with free joints: the motion that is nearest to a planned one.

    Args:
        trajectory: of the free joints.
        planned: of ``nao_ssp`` with the same robot and step.
        x: variables of the planned motion.
    """
    dense = planned.dense(FIT_FACTOR)
    assert dense is not None and dense.signals is not None  # a phase has both; for the type checker
    own = x[: sum("[" not in name for name in planned.names)]
    return np.concatenate([own, joint_coefficients(dense.signals(x, dense.p), SPANS[trajectory])])


def free_rows(
    robot: Robot, steps: int, found: FreeSamples, point: Point, path_middle: float, inner_edge: float
) -> tuple[Constraint, ...]:
    """Limits that planned motions keep by construction: joints, the swing foot's height, and its side of the other foot.

    Args:
        robot: whose limits they are.
        steps: N, even.
        found: the phase, N + 1 columns.
        point: symbols.
        path_middle: x of the swing foot halfway [m].
        inner_edge: y of the supporting sole's inner edge [m].
    """
    between = range(1, steps)
    corners = ("back right", "back left", "front right", "front left")

    def corner_rows(name: str, value: MX, columns: Sequence[int], corners: Sequence[str] = corners) -> Constraint:
        labels = tuple(f"{corner}, {k}" for k in columns for corner in corners)
        return Constraint(name=name, labels=labels, unit="m", scale=HEIGHT_SCALE, value=ca.vec(value), lower=MX(0.0))

    middle = steps // 2
    return (
        limit_rows(robot, "other_angle", OTHERS, found.others[:, 1:steps]),
        corner_rows("foot_height", found.heights[:, 1:steps], between),
        *halfway_rows(found.along[middle], path_middle, found.heights[:, middle], point["swing_height_m"], corners),
        corner_rows("feet_apart", inner_edge - found.sides[:, 1:steps], between, corners[1::2]),
    )
