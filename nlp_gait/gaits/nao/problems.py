"""The NAO problems: published phases, with free joints too, walking cycle, recorded gaits; options are in ``gaits.nao``."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Grid, load, maker
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.assembly import Quadrature
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.curves import SPLINE_SAMPLES, Trajectory, make_grid
from nlp_gait.gaits.biped.cycle import CycleObjective, plan_cycle
from nlp_gait.gaits.biped.footholds import parse_footholds
from nlp_gait.gaits.biped.footstep_walk import plan_footstep_walk
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import LOAD_DEGREE, TorsoShare, share_load
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import DOUBLE_SUPPORT, SINGLE_SUPPORT, Criterion, make_goal, make_phase_problem
from nlp_gait.gaits.biped.recorded_cycle import (
    RecordedCycles,
    RecordedGait,
    make_recorded_phase_problem,
    make_refinable,
)
from nlp_gait.gaits.biped.recorded_motion import FINE, LEAST_ROWS, LIFTED, RecordedMotion, make_places_function
from nlp_gait.gaits.biped.support_phases import make_support_phase, place_hip, place_soles, place_stance
from nlp_gait.gaits.biped.walk import plan_whole_walk
from nlp_gait.gaits.nao.body import ARM_SWING, Arms, ZmpGravity, ZmpMasses, make_nao
from nlp_gait.gaits.nao.free_joints import fit_joints, make_free_single_support_phase
from nlp_gait.gaits.nao.joints import JOINTS, RESTING_ARM_ANGLES, check_step_length
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
    return plan_cycle(body, grid, objective, share_load(body, torso_share, load_degree))


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


GAITS = ("nao-ssp", "nao-dsp", "nao-cycle")


def read_motion(angles: JointAngles, body: Body) -> RecordedMotion:
    """Return the motion of a robot on its left foot; mirrored if the right one stands. Arms that are missing are held.

    Raises InputError if a joint of the legs is missing, or times or angles are missing or out of order.
    """
    missing = [name for name in JOINTS if name not in angles.joints]
    needed = [name for name in missing if name not in RESTING_ARM_ANGLES]
    if needed:
        raise InputError(f"{angles.owner} has no angles of {', '.join(needed)}")
    if len(angles.t) < LEAST_ROWS:
        raise InputError(f"{angles.owner} has {len(angles.t)} rows; a motion needs {LEAST_ROWS}")
    if not (np.isfinite(angles.t).all() and np.diff(angles.t).min() > 0.0):
        raise InputError(f"{angles.owner}: times must ascend")
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    for name in JOINTS:
        if name in columns and not np.isfinite(columns[name]).all():
            raise InputError(f"{angles.owner}: an angle of {name} is missing")
    columns |= {name: np.full(len(angles.t), RESTING_ARM_ANGLES[name]) for name in missing}
    q = np.column_stack([columns[name] for name in JOINTS])
    motion = RecordedMotion(body=body, t=angles.t - angles.t[0], q=q, held=tuple(missing))
    heights = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))[:, 2]
    return motion.mirror_image() if -heights.min() > max(heights.max(), LIFTED) else motion


def make_nao_cycles(robot: str = "nao-v5", intervals: int = 10) -> RecordedCycles:
    """Return NAO, or a robot of its build, and the limits of ``nao-cycle``, by which its recorded cycles are judged."""
    return RecordedCycles(body=make_nao(robot), intervals=intervals, options={"robot": robot, "intervals": intervals})


def make_recorded_gait(
    angles: JointAngles,
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    gait: str | None = None,
    touch_down_s: float | None = None,
) -> RecordedGait:
    """Make a gait from angles over time; their last instant is its end.

    Without ``gait``, the problem with whose limits it is judged, and without ``touch_down_s``, where single support ends in a
    cycle, both are detected. Raises InputError for angles that are not a gait, or another gait than named.
    """
    if gait is not None and gait not in GAITS:
        raise InputError(f"a motion is judged by the limits of {', '.join(GAITS)}, got {gait!r}")
    cycles = make_nao_cycles(robot, intervals)
    body = cycles.body
    motion = read_motion(angles, body)
    phases: dict[Support, tuple[float, float]]
    if touch_down_s is None and gait in ("nao-ssp", "nao-dsp"):
        phases = {Support.SINGLE if gait == "nao-ssp" else Support.DOUBLE: (0.0, motion.duration_s)}
    else:
        phases = motion.phases(touch_down_s)
    found = "nao-cycle" if len(phases) > 1 else "nao-ssp" if Support.SINGLE in phases else "nao-dsp"
    if gait not in (None, found):
        raise InputError(
            f"{angles.owner} shows {found}, not {gait}: the right foot lands at no time before the end; name it with --touch-down"
        )
    foot = motion.right_foot(np.array([0.0, motion.duration_s]))
    step = float(foot[1, 0])
    if found == "nao-cycle":
        judged = cycles.judge(motion.t, motion.q, phases[Support.SINGLE][1])
        problem, x = judged.problem, tuple(judged.x.tolist())
    else:
        (name,) = phases
        problem = make_refinable(
            lambda grid: make_recorded_phase_problem(body, name, motion, grid), intervals, cycles.options
        )
        x = (motion.duration_s,)
        step = float(foot[1, 0] - foot[0, 0]) / 2 if name == Support.SINGLE else step
    cosine = float(make_places_function(body)(motion.q[0])[4])
    return RecordedGait(
        gait=found,
        problem=problem,
        x=x,
        motion=motion,
        step_m=step,
        lean_deg=float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        make_planned=partial(_load_planned, found, problem, x, step),
    )


def _load_planned(gait: str, recorded: GaitProblem, x: Sequence[float], step_m: float) -> GaitProblem:
    options = {key: recorded.options[key] for key in ("robot", "intervals")}
    problem = load(gait, **options) if gait == "nao-cycle" else load(gait, step_length_m=step_m, **options)
    fixed = dict(zip(recorded.names, x, strict=True))
    wider: dict[str, float] = {}
    for name, value in fixed.items():  # a recorded duration may violate its bounds; the optimum has the same duration
        low, high = problem.value(f"{name}.lower"), problem.value(f"{name}.upper")
        wider |= {f"{name}.lower": min(low, value), f"{name}.upper": max(high, value)}
    return problem.with_values(**wider).fix(**fixed)
