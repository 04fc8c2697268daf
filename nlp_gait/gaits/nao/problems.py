"""The NAO problems: the published phases, both with free joints, and the walking cycle; options are in ``gaits.nao``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, maker
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Trajectory, make_grid
from nlp_gait.gaits.biped.cycle import CycleObjective, plan_cycle
from nlp_gait.gaits.biped.double_support import (
    hip_ends,
    make_double_support_phase,
    place_soles,
    plan_double_support,
)
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import LOAD_DEGREE, TorsoShare, share_load
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import Criterion, make_goal, make_phase_problem
from nlp_gait.gaits.biped.single_support import place_stance, plan_single_support
from nlp_gait.gaits.nao.body import ARM_SWING, Arms, make_nao
from nlp_gait.gaits.nao.free_joints import fit_joints, make_free_single_support_phase
from nlp_gait.gaits.nao.joints import check_step_length
from nlp_gait.gaits.nao.leaning_torso import make_leaning_nao
from nlp_gait.gaits.nao.least_power.power_form import FORM_OPTIONS, power_form_maker
from nlp_gait.gaits.nao.least_power.power_instants import double_support_instants, single_support_instants


@maker
def nao_ssp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
    arms: Arms = "carried",
) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    check_step_length(step_length_m)
    body = make_nao(robot, rotational_inertia=rotational_inertia, motors=motors, arms=arms)
    power_form = None
    paper = (derivatives, trajectory, objective, motors) == FORM_OPTIONS and arms == "carried"
    if paper and samples_per_interval < 2:
        stance = place_stance(body, step_length_m)
        power_form = power_form_maker(
            body.robot, partial(single_support_instants, body.robot, *stance, ARM_SWING["ssp"])
        )
    grid, goal = make_grid(trajectory, intervals, samples_per_interval), make_goal(body, objective)
    problem = plan_single_support(body, step_length_m, grid, trajectory, goal, derivatives)
    return replace(problem, power_form=power_form)


@maker
def nao_dsp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    step_length_m: float = 0.06,
    samples_per_interval: int = 0,
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
    arms: Arms = "carried",
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Double support of NAO.

    The phase is taken apart into two single supports: each leg stands on its own foot and carries its own arm and a share of the
    torso, which depends on where the hip is between the feet.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.2 and 4.2.
    """
    check_step_length(step_length_m)
    if torso_share == "free" and arms != "carried":
        raise InputError(
            f"arms={arms!r} does not go with torso_share='free', where the legs carry all; choose arms='carried'"
        )
    body = make_nao(robot, rotational_inertia=rotational_inertia, motors=motors, arms=arms)
    power_form = None
    paper = (derivatives, trajectory, objective, motors) == FORM_OPTIONS and arms == "carried"
    if paper and samples_per_interval < 2 and torso_share != "free":
        soles = place_soles(body, step_length_m)
        places = (soles, hip_ends(body, soles), ARM_SWING["dsp"])
        power_form = power_form_maker(body.robot, partial(double_support_instants, body.robot, *places, torso_share))
    grid = make_grid(trajectory, intervals, samples_per_interval, planned_loads=torso_share == "free")
    goal, sharing = make_goal(body, objective), share_load(body, torso_share, load_degree)
    problem = plan_double_support(body, step_length_m, grid, trajectory, goal, sharing, derivatives)
    return replace(problem, power_form=power_form)


@maker
def nao_cycle(
    *,
    robot: str = "nao-v5",
    objective: CycleObjective = "energy-per-metre",
    intervals: int = 10,
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "lever",
    samples_per_interval: int = 0,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    The published phases cannot be chained: single support ends with the hip 0.03 m ahead of the stance foot, double support
    starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times and the step
    length are variables, and the cycle repeats after mirroring left to right.

    Args:
        robot: name or file.
        objective: ``"energy-per-metre"`` leaves the speed free; ``"power"``, and ``"torque"`` for the mean of the sum of squared
            torques, are those at the speed ``speed_m_s``, a parameter: the step length is then no variable but speed times the
            time of the cycle.
        intervals: of each phase.
        rotational_inertia: False takes every link as a point mass.
        torso_share: by the lever rule the nearer foot carries more, so that the load passes from foot to foot; as printed, the
            farther one; free plans the load of the foot that has landed.
        samples_per_interval: above 1 for a denser grid; 0 for what suits the loads: 4 where they are planned, else 1.
        motors: features of the real motors; the mean square of a continuous torque is that of each phase.
        load_degree: of the planned wrench over double support.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    body = make_nao(robot, rotational_inertia=rotational_inertia, motors=motors)
    grid = make_grid("cubic", intervals, samples_per_interval, planned_loads=torso_share == "free")
    return plan_cycle(body, grid, objective, share_load(body, torso_share, load_degree))


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
    """Single support of NAO with free joints. One of the samples must be the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    if grid.parts % 2:
        raise InputError(f"intervals * samples_per_interval must be even, got {grid.parts}: one sample is the middle")
    body = make_nao(robot, rotational_inertia=rotational_inertia)
    phase = make_free_single_support_phase(body, step_length_m, trajectory, grid)

    @cache
    def make_planned() -> GaitProblem:
        return nao_ssp(robot=robot, rotational_inertia=rotational_inertia, step_length_m=step_length_m)

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Start from the paper's motion, for random values of its variables."""
        return fit_joints(trajectory, make_planned(), draw_uniform(phase.free.paper.names, parameters, rng))

    title = "single support with free joints: least mean power"
    return make_phase_problem("ssp-free", title, phase, start=start, searchable=False)


@maker
def nao_dsp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "printed",
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
    load_degree: int = LOAD_DEGREE,
) -> GaitProblem:
    """Double support of NAO with every freedom that two flat soles leave.

    The curves are those of ``nao-dsp`` and the torso's roll and pitch, zero and at rest at both ends; with zero coefficients on
    these the motion is that of ``nao-dsp``.

    Source:
        Ends, limits, loads and objective of Gupta, Pratihar, Deb (2023), section 4.2; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    body = make_leaning_nao(make_nao(robot, rotational_inertia=rotational_inertia))
    splines, sharing = body.make_splines("dsp", trajectory), share_load(body, torso_share, load_degree)
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    phase = make_double_support_phase(body, step_length_m, splines, sharing, grid, Goal())
    title, start = "double support with a leaning torso: least mean power", splines.start_of(phase.names)
    return make_phase_problem("dsp-free", title, phase, start=sharing.start(phase.names, start), searchable=False)
