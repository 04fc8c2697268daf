"""The NAO problems: published phases, with free joints too, walking cycle; options are in ``gaits.nao``."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, maker
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.assembly import Quadrature
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Trajectory, make_grid
from nlp_gait.gaits.biped.cycle import CycleObjective, Landing, plan_cycle
from nlp_gait.gaits.biped.footholds import parse_footholds
from nlp_gait.gaits.biped.footstep_walk import plan_footstep_walk
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import LOAD_DEGREE, TorsoShare, share_load
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import DOUBLE_SUPPORT, SINGLE_SUPPORT, Criterion, make_goal, make_phase_problem
from nlp_gait.gaits.biped.support_phases import make_support_phase, place_hip, place_soles, place_stance
from nlp_gait.gaits.biped.walk import plan_whole_walk
from nlp_gait.gaits.nao.body import ARM_SWING, Arms, ZmpGravity, ZmpMasses, make_nao
from nlp_gait.gaits.nao.free_joints import fit_joints, make_free_single_support_phase
from nlp_gait.gaits.nao.joints import check_step_length
from nlp_gait.gaits.nao.leaning_torso import make_leaning_nao
from nlp_gait.gaits.nao.least_power.power_form import FORM_OPTIONS, make_power_form_maker
from nlp_gait.gaits.nao.least_power.power_instants import make_double_support, make_single_support


@maker
def nao_ssp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    derivatives: Derivatives = "analytic",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
    arms: Arms = "carried",
    zmp_gravity: ZmpGravity = "physical",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Single support of NAO; the swing foot moves by twice the step length.

    Source:
        Gupta, Pratihar, Deb (2023), sections 3.1 and 4.1.
    """
    check_step_length(step_length_m)
    body = make_nao(
        robot, rotational_inertia=rotational_inertia, motors=motors, arms=arms, zmp_gravity=zmp_gravity, limits=limits
    )
    power_form = None
    if (
        derivatives,
        trajectory,
        objective,
        motors,
        arms,
        zmp_gravity,
        rule,
    ) == FORM_OPTIONS and samples_per_interval < 2:
        places = body.robot, place_stance(body, step_length_m), ARM_SWING[Support.SINGLE]
        power_form = make_power_form_maker(body.robot, partial(make_single_support, *places))
    grid, goal = make_grid(trajectory, intervals, samples_per_interval, rule=rule), make_goal(body, objective)
    phase = make_support_phase(body, Support.SINGLE, step_length_m, trajectory, grid, goal, derivatives=derivatives)
    return replace(make_phase_problem(Support.SINGLE, SINGLE_SUPPORT, phase), power_form=power_form)


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
    rule: Quadrature = "trapezoid",
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    motors: str = "",
    arms: Arms = "carried",
    zmp_gravity: ZmpGravity = "physical",
    zmp_masses: ZmpMasses = 25,
    load_degree: int = LOAD_DEGREE,
    limits: str | AddedLimits = "",
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
    body = make_nao(
        robot,
        rotational_inertia=rotational_inertia,
        motors=motors,
        arms=arms,
        zmp_gravity=zmp_gravity,
        zmp_masses=zmp_masses,
        limits=limits,
    )
    power_form = None
    paper = (derivatives, trajectory, objective, motors, arms, zmp_gravity, rule) == FORM_OPTIONS and zmp_masses == 25
    if paper and samples_per_interval < 2 and torso_share != "free":
        soles = place_soles(body, step_length_m)
        places = (soles, place_hip(body, soles), ARM_SWING[Support.DOUBLE])
        power_form = make_power_form_maker(body.robot, partial(make_double_support, body.robot, *places, torso_share))
    grid = make_grid(trajectory, intervals, samples_per_interval, planned_loads=torso_share == "free", rule=rule)
    goal, sharing = make_goal(body, objective), share_load(body, torso_share, load_degree)
    phase = make_support_phase(body, Support.DOUBLE, step_length_m, trajectory, grid, goal, sharing, derivatives)
    return replace(make_phase_problem(Support.DOUBLE, DOUBLE_SUPPORT, phase), power_form=power_form)


@maker
def nao_cycle(
    *,
    robot: str = "nao-v5",
    objective: CycleObjective = "energy-per-metre",
    intervals: int = 10,
    rotational_inertia: bool = True,
    torso_share: TorsoShare = "lever",
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
    landing: Landing = "soft",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    The published phases cannot be chained: single support ends with the hip 0.03 m ahead of the stance foot, double support
    starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times and the step
    length are variables, and the cycle repeats after mirroring left to right.

    ``objective="energy-per-metre"`` leaves the speed free; ``"power"``, and ``"torque"`` for the mean of the sum of squared
    torques, are those at the speed ``speed_m_s``, a parameter: the step length is then speed times the time of the cycle. By
    ``torso_share="lever"`` the nearer foot carries more, so that the load passes from foot to foot; as printed, the farther one.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    body = make_nao(robot, rotational_inertia=rotational_inertia, motors=motors, limits=limits)
    grid = make_grid("cubic", intervals, samples_per_interval, planned_loads=torso_share == "free", rule=rule)
    return plan_cycle(body, grid, objective, share_load(body, torso_share, load_degree), landing)


@maker
def nao_walk(
    *,
    robot: str = "nao-v5",
    steps: int = 10,
    intervals: int = 10,
    rotational_inertia: bool = True,
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    slope_deg: float = 0.0,
    footholds: str = "",
    motors: str = "",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Whole walk of NAO from standing to standing: weight shift, half step, steps, half step, weight shift.

    All inner steps are one cycle, as in ``nao-cycle``; its speed may have limits, which are parameters. The feet advance by one
    step length less than there are steps, because the first and the last one are half steps.

    ``steps`` are swings of a foot, both half steps included. On ground that rises forward by ``slope_deg`` all places are in its
    axes, in which gravity is tilted. ``footholds``, rows ``x,y,z,yaw`` [m, degrees] separated by semicolons, are where the right
    foot, the left foot and so on land instead; then every step has its own states. All angles are 0: one motor turns both feet.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """
    body = make_nao(robot, rotational_inertia=rotational_inertia, motors=motors, limits=limits).tilt_ground(slope_deg)
    grid = make_grid("cubic", intervals, samples_per_interval, rule=rule)
    if not footholds:
        return plan_whole_walk(body, steps, grid)
    places = parse_footholds(footholds)
    if slope_deg or any(place.yaw for place in places):
        raise InputError("footholds of NAO are on a level floor and all point forward; leave out slope_deg and angles")
    return plan_footstep_walk(body, places, steps, grid)


@maker
def nao_ssp_free(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    trajectory: Trajectory = "spline-4",
    rotational_inertia: bool = True,
    step_length_m: float = 0.06,
    samples_per_interval: int = SPLINE_SAMPLES,
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Single support of NAO with free joints. One of the samples must be the middle.

    Source:
        Ends, limits and objective of Gupta, Pratihar, Deb (2023), section 4.1; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    if grid.parts % 2:
        raise InputError(f"intervals * samples_per_interval must be even, got {grid.parts}: one sample is the middle")
    body = make_nao(robot, rotational_inertia=rotational_inertia, limits=limits)
    phase = make_free_single_support_phase(body, step_length_m, trajectory, grid)

    @cache
    def make_planned() -> GaitProblem:
        return nao_ssp(robot=robot, rotational_inertia=rotational_inertia, step_length_m=step_length_m)

    def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Start from the paper's motion, for random values of its variables."""
        return fit_joints(trajectory, make_planned(), draw_uniform(phase.paper.names, parameters, rng))

    title = "single support with free joints: least mean power"
    return make_phase_problem("ssp-free", title, replace(phase, start=start), searchable=False)


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
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Double support of NAO with every freedom that two flat soles leave.

    The curves are those of ``nao-dsp`` and the torso's roll and pitch, zero and at rest at both ends; with zero coefficients on
    these the motion is that of ``nao-dsp``.

    Source:
        Ends, limits, loads and objective of Gupta, Pratihar, Deb (2023), section 4.2; the formulation is this package's own.
    """
    check_step_length(step_length_m)
    body = make_leaning_nao(make_nao(robot, rotational_inertia=rotational_inertia, limits=limits))
    sharing = share_load(body, torso_share, load_degree)
    grid = Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
    phase = make_support_phase(body, Support.DOUBLE, step_length_m, trajectory, grid, Goal(), sharing)
    return make_phase_problem(
        "dsp-free", "double support with a leaning torso: least mean power", phase, searchable=False
    )
