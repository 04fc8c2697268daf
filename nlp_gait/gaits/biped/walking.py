"""Options of cycles and of whole walks, each declared and explained once, and how the problems are made of them."""

from dataclasses import dataclass

from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.cycle import CycleObjective, make_cycle_problem, make_walking_cycle
from nlp_gait.gaits.biped.flight import Flight
from nlp_gait.gaits.biped.footholds import parse_footholds
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase_problem import make_goal
from nlp_gait.gaits.biped.problems import LoadOptions, SampleOptions
from nlp_gait.gaits.biped.walk import plan_footstep_walk, plan_straight_walk


@dataclass(frozen=True, kw_only=True)
class CycleOptions(SampleOptions, LoadOptions):
    """One step, whose mirror image is the next one.

    Attributes:
        objective: what is minimised: energy per metre, which leaves the speed free; or power, or torque, the mean of the sum of
            squared torques, at the speed ``speed_m_s``, a parameter: the step length is then speed times the time of the cycle
    """

    objective: CycleObjective = "energy-per-metre"


@dataclass(frozen=True, kw_only=True)
class WalkOptions(SampleOptions):
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
    goal = make_goal(body, "torque" if options.objective == "torque" else "power")
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
