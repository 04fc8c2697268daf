"""Options of the problems of bipeds, each declared and explained once, and how phases, cycles and walks are made of them."""

from dataclasses import dataclass
from typing import Literal

from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Grid
from nlp_gait.formulation.added_limits import AddedLimits
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.curves import Trajectory
from nlp_gait.gaits.biped.cycle import make_cycle_problem, make_walking_cycle
from nlp_gait.gaits.biped.footholds import Flight, parse_footholds
from nlp_gait.gaits.biped.limits import GOALS, GoalName
from nlp_gait.gaits.biped.loads import Division, make_divided_loads
from nlp_gait.gaits.biped.phase import Derivatives
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.biped.walk import plan_footstep_walk, plan_straight_walk

SPLINE_SAMPLES = 4  # default samples in each interval of a spline, which can bend between 11 samples; a cubic cannot


@dataclass(frozen=True, kw_only=True)
class RobotOptions:
    """The robot and limits that are added to those of its gait.

    Attributes:
        robot: name of the robot, or its file: URDF, MJCF or JSON
        limits: more limits of every phase, separated by commas: of ``nlp-gait list limits``, or your own, FILE.py:NAME
    """

    robot: str = "nao-v5"
    limits: str | AddedLimits = ""


@dataclass(frozen=True, kw_only=True)
class GridOptions:
    """Samples of a phase.

    Attributes:
        intervals: equal parts of a phase over which torques may change by the limit
        samples_per_interval: above 1 for a grid that is denser than the intervals; 0 for what suits the trajectory: 1 with
            cubics, 4 with splines, which would otherwise bend between the samples
    """

    intervals: int = 10
    samples_per_interval: int = 0

    def make_grid(self, trajectory: Trajectory = "cubic") -> Grid:
        """Return the samples, which suit the trajectory."""
        samples = self.samples_per_interval or (1 if trajectory == "cubic" else SPLINE_SAMPLES)
        return Grid(intervals=self.intervals, samples_per_interval=samples, refined_by="samples_per_interval")


@dataclass(frozen=True, kw_only=True)
class StepOptions:
    """A step of one phase, and its curves.

    Attributes:
        step_length_m: from foot to foot; 0 for NAO's 0.06 m in proportion
        trajectory: of hip, swing foot, arms and torso, or of every free joint: the paper's cubics, or cubics plus splines
    """

    step_length_m: float = 0.0
    trajectory: Trajectory = "cubic"


@dataclass(frozen=True, kw_only=True)
class PhaseOptions(StepOptions, GridOptions):
    """A phase as in the paper.

    Attributes:
        objective: what is minimised, a mean over the phase; power is the paper's
    """

    objective: GoalName = "power"


@dataclass(frozen=True, kw_only=True)
class LoadOptions:
    """Load of double support.

    Attributes:
        torso_share: rule that divides the torso's mass between the legs in double support: lever, by which the nearer foot
            carries more, or printed, by which the farther one does; see ``loads.share_torso``
    """

    torso_share: Division = "lever"


def make_support_problem(
    body: Body, options: PhaseOptions, loads: LoadOptions | None = None, derivatives: Derivatives = "analytic"
) -> GaitProblem:
    """Return the problem of single support, or of double support with its loads."""
    step_m, goal = body.check_step_length(options.step_length_m), GOALS[options.objective]
    kind, legs = (Support.SINGLE, "one leg") if loads is None else (Support.DOUBLE, "two legs")
    minimised = "mean motor power" if options.objective == "power" else goal.objective.name.replace("_", " ")
    loader = None if loads is None else make_divided_loads(body, loads.torso_share)
    grid = options.make_grid(options.trajectory)
    phase = make_support_phase(body, kind, step_m, options.trajectory, grid, goal, loader, derivatives)
    return make_phase_problem(kind, f"on {legs}: {minimised}", phase)


@dataclass(frozen=True, kw_only=True)
class CycleOptions(GridOptions, LoadOptions):
    """One step, whose mirror image is the next one.

    Attributes:
        objective: what is minimised: energy per metre, which leaves the speed free; or a mean over the cycle, as of a phase, at
            the speed ``speed_m_s``, a parameter: the step length is then speed times the time of the cycle
    """

    objective: Literal["energy-per-metre", GoalName] = "energy-per-metre"


@dataclass(frozen=True, kw_only=True)
class WalkOptions(GridOptions):
    """A walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    All inner steps are one cycle, whose speed may have limits, which are parameters.

    Attributes:
        steps: swings of a foot; the first and the last one are half steps, so that the feet advance by one step length less
        slope_deg: by which the ground rises forward; all places are in its axes, in which gravity is tilted
        footholds: rows ``x,y,z,yaw`` [m, degrees], separated by semicolons: where the right foot, the left foot and so on land
            instead; every step then has its own states
    """

    steps: int = 10
    slope_deg: float = 0.0
    footholds: str = ""


def plan_cycle(body: Body, options: CycleOptions) -> GaitProblem:
    """Return the problem of a cycle."""
    goal = GOALS["power" if options.objective == "energy-per-metre" else options.objective]
    cycle = make_walking_cycle(
        body,
        make_divided_loads(body, options.torso_share),
        options.make_grid(),
        goal,
        at_given_speed=options.objective != "energy-per-metre",
    )
    return make_cycle_problem(cycle)


def plan_walk(body: Body, options: WalkOptions, flight: Flight | None = None) -> GaitProblem:
    """Return the problem of a whole walk, on a slope, up a flight of stairs or along footholds; raises InputError."""
    body, grid = body.tilt_ground(options.slope_deg), options.make_grid()
    if not options.footholds:
        return plan_straight_walk(body, options.steps, grid, flight)
    if options.slope_deg or flight:
        raise InputError("footholds are on a level floor; leave out slope_deg and the sizes of stairs")
    places = parse_footholds(options.footholds)
    body.check_footholds(places)
    return plan_footstep_walk(body, places, options.steps, grid)
