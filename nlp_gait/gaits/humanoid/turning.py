"""How sharply a humanoid can turn from step to step: limits of the hip joints about the vertical, and soles that would meet."""

import itertools
import math
from typing import NamedTuple

from nlp_gait.errors import InputError, check_count
from nlp_gait.gaits.biped.footholds import list_arc, parse_footholds
from nlp_gait.gaits.humanoid.body import Humanoid

FINE_DEG = 0.5
ARC_STEPS = 6  # of a turn whose steps are tried
LARGEST_TURN_DEG = 720.0
USUAL_TURN_DEG, STEP_SHARE = 15.0, 2 / 3  # of a step by default: its angle, and its length as a share of the usual one


class SharpestTurn(NamedTuple):
    """Greatest angle between consecutive footholds of a turn with steps of a length."""

    turn_deg: float
    step_m: float
    stopped_by: str


def list_turn(body: Humanoid, turn_deg: float, steps: int | None, distance_m: float | None) -> str:
    """Return the footholds of a turn to the left along an arc; see ``plan_walk``. Raises InputError if it is too sharp."""
    if isinstance(turn_deg, bool) or not 0.0 < abs(turn_deg) <= LARGEST_TURN_DEG:
        raise InputError(f"turn_deg must be within +-{LARGEST_TURN_DEG:g}, got {turn_deg!r}")
    count = math.ceil(abs(turn_deg) / USUAL_TURN_DEG) + 1 if steps is None else check_count("steps", steps, at_least=2)
    step_m = STEP_SHARE * body.step_length_m if distance_m is None else distance_m / (count - 1)
    sharpest, angle = find_sharpest_turn(body, step_m), abs(turn_deg) / (count - 1)
    if angle > sharpest.turn_deg:
        raise InputError(
            f"a turn of {turn_deg:g} degrees in {count} steps is one of {angle:.3g} in each step but the last, and the "
            f"sharpest with steps of {step_m:.3g} m is {sharpest.turn_deg:g}: {sharpest.stopped_by}; take more steps"
        )
    return list_arc(turn_deg, count, step_m * (count - 1), body.feet_y)


def find_sharpest_turn(body: Humanoid, step_m: float | None = None) -> SharpestTurn:
    """Return the sharpest turn of equal steps of a length [m], or of that of turns by default, and what stops a sharper one."""
    step_m = STEP_SHARE * body.step_length_m if step_m is None else step_m
    for k in itertools.count(1):
        arc = list_arc(ARC_STEPS * k * FINE_DEG, ARC_STEPS + 1, ARC_STEPS * step_m, body.feet_y)
        if stop := body.find_turn_stop(parse_footholds(arc)):
            return SharpestTurn((k - 1) * FINE_DEG, step_m, stop)
    raise AssertionError("soles meet at the latest when a foot has turned around")
