"""NAO's single support with every joint free: least mean power, the floor under all plans of hip, foot and arms."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, maker
from nlp_gait.gaits.biped.curves import SPANS, SPLINE_SAMPLES, Splines, Trajectory
from nlp_gait.gaits.biped.single_support import single_support_mean_margins
from nlp_gait.gaits.nao.body import JOINTS, PLANNED_JOINTS, nao
from nlp_gait.gaits.nao.free_joints import FreeLimits, FreeMotion, FreePhase, free_splines, joint_coefficients
from nlp_gait.gaits.nao.legs import check_step_length, hip_variables
from nlp_gait.gaits.nao.problem import paper_parts, phase_problem
from nlp_gait.gaits.nao.single_support import (
    DURATION,
    OWN_VARIABLES,
    UNITS,
    nao_ssp,
    single_support_duration,
    single_support_loads,
    single_support_margins,
    single_support_plan,
    stance_of,
)

FIT_FACTOR = 40  # samples of a planned motion, in each of its own, to which free joints are fitted


@maker
def nao_ssp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
) -> GaitProblem:
    """Single support of NAO with free joints; for the options see ``gaits.nao``. One of the samples must be the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    if grid.parts % 2:
        raise InputError(f"intervals * samples_per_interval must be even, got {grid.parts}: one sample is the middle")
    model = nao(robot, rotational_inertia)
    stance, foot = stance_of(model, step_length_m), model.feet["left"]
    own = (*hip_variables(model), *OWN_VARIABLES)
    splines = free_splines(trajectory)
    motion = FreeMotion(
        robot=model,
        splines=splines,
        paper=single_support_plan(model, stance, Splines(trajectory="cubic", units=UNITS)),
        loads=single_support_loads(model, upright=()),
        support=(*stance.support_xy, foot.ankle_height_m),
        duration=single_support_duration,
    )
    phase = FreePhase(
        robot=model,
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        variables=(*own, *splines.variables),
        duration=DURATION,
        plan=motion.plan,
        loads=motion.loads,
        grid=grid,
        parts=(
            *paper_parts(model, single_support_margins(stance.support_xy, foot), single_support_mean_margins(foot)),
            FreeLimits(model, sum(stance.swing_x) / 2, stance.support_xy[1] - foot.right_m),
        ),
        free=motion,
        kinks=splines.kinks,
    )

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """The paper's motion, for random values of its variables."""
        lower, upper = (np.array([parameters[f"{v.name}.{end}"] for v in own]) for end in ("lower", "upper"))
        return fitted_start(trajectory, planned(), rng.uniform(lower, upper))

    @cache
    def planned() -> GaitProblem:
        return nao_ssp(robot=robot, rotational_inertia=rotational_inertia, step_length_m=step_length_m)

    return phase_problem(
        "nao-ssp-free",
        "NAO, single support with free joints: least mean power",
        phase,
        robot,
        start=start,
        searchable=False,
    )


def fitted_start(trajectory: Trajectory, planned: GaitProblem, x: Array) -> Array:
    """Start point (n,) with free joints: the motion that is nearest to a planned one.

    Args:
        trajectory: of the free joints.
        planned: of ``nao_ssp`` with the same robot and step.
        x: variables of the planned motion.
    """
    dense = planned.dense(FIT_FACTOR)
    assert dense is not None  # a phase has one; for the type checker
    own = x[: sum("[" not in name for name in planned.names)]
    return np.concatenate([own, joint_coefficients(dense.signals(x), SPANS[trajectory])])
