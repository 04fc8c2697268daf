"""Options of cycles and of whole walks, and how NAO's and other humanoids' problems are made of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.cycle import CycleObjective, Landing, plan_cycle
from nlp_gait.gaits.biped.flight import Flight
from nlp_gait.gaits.biped.footholds import Foothold, parse_footholds
from nlp_gait.gaits.biped.footstep_walk import plan_footstep_walk
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.problems import LoadOptions, SampleOptions
from nlp_gait.gaits.biped.walk import plan_whole_walk


@dataclass(frozen=True, kw_only=True)
class CycleOptions(SampleOptions, LoadOptions):
    """One step, whose mirror image is the next one."""

    objective: CycleObjective = "energy-per-metre"
    landing: Landing = "soft"


@dataclass(frozen=True, kw_only=True)
class WalkOptions(SampleOptions):
    """A walk from standing to standing."""

    steps: int = 10
    slope_deg: float = 0.0
    footholds: str = ""


def make_cycle_problem(body: Body, options: CycleOptions) -> GaitProblem:
    """Return the problem of a cycle."""
    loads = make_divided_loads(body, options.torso_share)
    return plan_cycle(body, options.make_grid(), options.objective, loads, options.landing)


def make_walk_problem(
    body: Body, options: WalkOptions, check: Callable[[Sequence[Foothold]], None], flight: Flight | None = None
) -> GaitProblem:
    """Return the problem of a whole walk, on a slope, up a flight of stairs or along footholds, which ``check`` may refuse."""
    body, grid = body.tilt_ground(options.slope_deg), options.make_grid()
    if not options.footholds:
        return plan_whole_walk(body, options.steps, grid, flight)
    if options.slope_deg or flight:
        raise InputError("footholds are on a level floor; leave out slope_deg and the sizes of stairs")
    places = parse_footholds(options.footholds)
    check(places)
    return plan_footstep_walk(body, places, options.steps, grid)
