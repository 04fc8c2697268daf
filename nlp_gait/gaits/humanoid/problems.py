"""The humanoid problems: single support, double support and walking cycle; options are in ``gaits.humanoid``."""

from typing import Literal

from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, maker
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.formulation.assembly import Quadrature
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.curves import Trajectory, make_grid
from nlp_gait.gaits.biped.cycle import CycleObjective, Landing, plan_cycle
from nlp_gait.gaits.biped.flight import CLEARANCE_M, Flight
from nlp_gait.gaits.biped.footholds import parse_footholds
from nlp_gait.gaits.biped.footstep_walk import plan_footstep_walk
from nlp_gait.gaits.biped.load_sharing import LOAD_DEGREE, share_load
from nlp_gait.gaits.biped.phase_problem import DOUBLE_SUPPORT, SINGLE_SUPPORT, Criterion, make_goal, make_phase_problem
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.biped.walk import plan_whole_walk
from nlp_gait.gaits.humanoid.body import make_humanoid
from nlp_gait.gaits.humanoid.turning import check_turns

Share = Literal["lever", "free"]


@maker
def humanoid_ssp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    step_length_m: float = 0.0,
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    drive_limits: bool = True,
    motors: str = "",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Single support; the swing foot moves by twice the step length.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.1; general legs and the free lean of the torso are this package's own.
    """
    body = make_humanoid(robot, drive_limits=drive_limits, motors=motors, limits=limits)
    step_m = body.check_step_length(step_length_m)
    grid, goal = make_grid(trajectory, intervals, samples_per_interval, rule=rule), make_goal(body, objective)
    phase = make_support_phase(body, Support.SINGLE, step_m, trajectory, grid, goal)
    return make_phase_problem(Support.SINGLE, SINGLE_SUPPORT, phase)


@maker
def humanoid_dsp(
    *,
    robot: str = "nao-v5",
    intervals: int = 10,
    torso_share: Share = "lever",
    step_length_m: float = 0.0,
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    trajectory: Trajectory = "cubic",
    objective: Criterion = "power",
    drive_limits: bool = True,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Double support, the right foot a step ahead.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.2; general legs and the free lean of the torso are this package's own.
    """
    body = make_humanoid(robot, drive_limits=drive_limits, motors=motors, limits=limits)
    step_m = body.check_step_length(step_length_m)
    grid = make_grid(trajectory, intervals, samples_per_interval, planned_loads=torso_share == "free", rule=rule)
    goal, sharing = make_goal(body, objective), share_load(body, torso_share, load_degree)
    phase = make_support_phase(body, Support.DOUBLE, step_m, trajectory, grid, goal, sharing)
    return make_phase_problem(Support.DOUBLE, DOUBLE_SUPPORT, phase)


@maker
def humanoid_cycle(
    *,
    robot: str = "nao-v5",
    objective: CycleObjective = "energy-per-metre",
    intervals: int = 10,
    torso_share: Share = "lever",
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    drive_limits: bool = True,
    motors: str = "",
    load_degree: int = LOAD_DEGREE,
    landing: Landing = "soft",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Walking cycle: one step, whose mirror image is the next one.

    ``objective=power``, and ``torque`` for the mean of the sum of squared torques, are those at the speed ``speed_m_s``, a
    parameter: the step length follows from it.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; general legs, the free lean of the torso and the
        cycle are this package's own.
    """
    body = make_humanoid(robot, drive_limits=drive_limits, motors=motors, limits=limits)
    grid = make_grid("cubic", intervals, samples_per_interval, planned_loads=torso_share == "free", rule=rule)
    return plan_cycle(body, grid, objective, share_load(body, torso_share, load_degree), landing)


@maker
def humanoid_walk(
    *,
    robot: str = "nao-v5",
    steps: int = 10,
    intervals: int = 10,
    samples_per_interval: int = 0,
    rule: Quadrature = "trapezoid",
    slope_deg: float = 0.0,
    stair_rise_m: float = 0.0,
    stair_run_m: float = 0.0,
    footholds: str = "",
    drive_limits: bool = True,
    motors: str = "",
    limits: str | AddedLimits = "",
) -> GaitProblem:
    """Whole walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    All inner steps are one cycle, as in ``humanoid-cycle``; its speed may have limits, which are parameters. The feet advance by
    one step length less than there are steps, because the first and the last one are half steps.

    ``footholds``, rows ``x,y,z,yaw`` [m, degrees] separated by semicolons, are where the right foot, the left foot and so on land
    instead; then every step has its own states.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """
    body = make_humanoid(robot, drive_limits=drive_limits, motors=motors, limits=limits).tilt_ground(slope_deg)
    grid = make_grid("cubic", intervals, samples_per_interval, rule=rule)
    if footholds:
        if slope_deg or stair_rise_m or stair_run_m:
            raise InputError("footholds are on a level floor; leave out slope_deg and the sizes of stairs")
        places = parse_footholds(footholds)
        check_turns(body, places)
        return plan_footstep_walk(body, places, steps, grid)
    flight = None
    if stair_rise_m or stair_run_m:
        foot = body.robot.feet["left"]
        clearance_m = body.scale_length(CLEARANCE_M)
        flight = Flight(rise_m=stair_rise_m, run_m=stair_run_m, foot=foot, clearance_m=clearance_m)
        if slope_deg:
            raise InputError(f"stairs are level, but slope_deg is {slope_deg:g}; leave out one of them")
    return plan_whole_walk(body, steps, grid, flight)
