"""The humanoid problems: single support, double support and walking cycle."""

from dataclasses import dataclass

from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, maker
from nlp_gait.gaits.biped.footholds import CLEARANCE_M, Flight
from nlp_gait.gaits.biped.problems import (
    CycleOptions,
    LoadOptions,
    PhaseOptions,
    RobotOptions,
    WalkOptions,
    make_support_problem,
    plan_cycle,
    plan_walk,
)
from nlp_gait.gaits.humanoid.body import Humanoid, make_humanoid


@dataclass(frozen=True, kw_only=True)
class HumanoidOptions(RobotOptions):
    """The robot, and which of its limits count.

    Attributes:
        drive_limits: whether torques and speeds must be within the limits of the robot's file
    """

    drive_limits: bool = True

    def make_body(self) -> Humanoid:
        """Return the robot as its gaits take it."""
        return make_humanoid(**vars(self))


@dataclass(frozen=True, kw_only=True)
class Stairs:
    """Stairs that a walk climbs.

    Attributes:
        stair_rise_m: of each tread of a flight of stairs, one with each step; 0 for no stairs
        stair_run_m: depth of each tread, which is then the step length
    """

    stair_rise_m: float = 0.0
    stair_run_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Sides:
    """How a robot whose left and right differ is planned, where a step and its mirror image are one.

    Attributes:
        alike: take left and right as alike, though they differ by over 2 %: steps on the right foot may then break limits
    """

    alike: bool = False

    def check(self, body: Humanoid) -> None:
        """Raise InputError for a robot whose left and right differ, unless they are taken as alike."""
        if body.biped.differences and not self.alike:
            raise InputError(
                f"robot {body.full.name!r}: a step and its mirror image are planned as one here, but left and right differ: "
                f"{'; '.join(body.biped.differences[:3])}; plan a walk on a level floor, which plans every step with its own "
                "side, or set alike=true"
            )


@maker
def humanoid_ssp(robot: HumanoidOptions, options: PhaseOptions) -> GaitProblem:
    """Single support; the swing foot moves by twice the step length.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.1; general legs and the free lean of the torso are this package's own.
    """
    return make_support_problem(robot.make_body(), options)


@maker
def humanoid_dsp(robot: HumanoidOptions, options: PhaseOptions, loads: LoadOptions) -> GaitProblem:
    """Double support, the right foot a step ahead.

    Source:
        Phase of Gupta, Pratihar, Deb (2023), section 4.2; general legs and the free lean of the torso are this package's own.
    """
    return make_support_problem(robot.make_body(), options, loads)


@maker
def humanoid_cycle(robot: HumanoidOptions, options: CycleOptions, sides: Sides) -> GaitProblem:
    """Walking cycle: one step, whose mirror image is the next one.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; general legs, the free lean of the torso and the
        cycle are this package's own.
    """
    body = robot.make_body()
    sides.check(body)
    return plan_cycle(body, options)


@maker
def humanoid_walk(robot: HumanoidOptions, options: WalkOptions, stairs: Stairs, sides: Sides) -> GaitProblem:
    """Whole walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """
    body, flight = robot.make_body(), None
    if not options.footholds:
        sides.check(body)
    if stairs.stair_rise_m or stairs.stair_run_m:
        if options.slope_deg:
            raise InputError(f"stairs are level, but slope_deg is {options.slope_deg:g}; leave out one of them")
        foot, clearance_m = body.robot.feet["left"], body.scale_length(CLEARANCE_M)
        flight = Flight(rise_m=stairs.stair_rise_m, run_m=stairs.stair_run_m, foot=foot, clearance_m=clearance_m)
    return plan_walk(body, options, flight)
