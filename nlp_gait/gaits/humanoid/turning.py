"""How sharply a humanoid can turn from step to step: limits of the hip joints about the vertical, and soles that would meet."""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nlp_gait.errors import InputError, check_count
from nlp_gait.gaits.biped.footholds import Foothold, list_arc, list_swings, meets, parse_footholds
from nlp_gait.gaits.humanoid.body import Humanoid
from nlp_gait.robots.biped import Biped

UPRIGHT = 0.9  # vertical component of the axis of a joint that turns a leg
FINE_DEG = 0.5
ARC_STEPS = 6  # of a turn whose steps are tried
LARGEST_TURN_DEG = 720.0
USUAL_TURN_DEG, STEP_SHARE = 15.0, 2 / 3  # of a step by default: its angle, and its length as a share of the usual one


class SharpestTurn(NamedTuple):
    """Greatest angle between consecutive footholds of a turn with steps of a length."""

    turn_deg: float
    step_m: float
    stopped_by: str


def find_stiff_joint(biped: Biped, yaw: float) -> tuple[str, float] | None:
    """Return the hip joint that forbids a yaw between the feet [rad], of which each leg turns half, and the largest allowed."""
    for side, leg in biped.legs.items():
        turn = (yaw if side == "right" else -yaw) / 2
        for axis, (low, high), joint in zip(leg.axes[:3], leg.limits_rad, leg.joints, strict=False):
            angle = turn * np.sign(axis[2])
            if abs(axis[2]) > UPRIGHT and not low <= angle <= high:
                return joint, 2 * abs(float(low if angle < low else high))
    return None


def find_turn_stop(body: Humanoid, footholds: Sequence[Foothold]) -> str | None:
    """Return what does not allow the first step that hip joints or soles do not allow, in words; None if all are allowed."""
    standing = Foothold(0.0, body.feet_y[0], 0.0).outline(body.robot.feet["left"])
    for k, (lifted, landed) in enumerate(list_swings(footholds, body.feet_y), 1):
        if stiff := find_stiff_joint(body.biped, landed.yaw):
            turned, allowed = (math.degrees(angle) for angle in (abs(landed.yaw), stiff[1]))
            return f"step {k} turns by {turned:.3g} degrees, and the limits of {stiff[0]} allow {allowed:.3g}"
        if meets(standing, body.robot.feet["right"], lifted, landed):
            return f"in step {k} the swinging sole passes over the standing one"
    return None


def check_turns(body: Humanoid, footholds: Sequence[Foothold]) -> None:
    """Raise InputError if hip joints do not allow the angle between two footholds, or a swinging sole meets the other one."""
    if stop := find_turn_stop(body, footholds):
        raise InputError(f"{stop}; take more steps, turn by smaller angles, or place the feet further apart")


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
        if stop := find_turn_stop(body, parse_footholds(arc)):
            return SharpestTurn((k - 1) * FINE_DEG, step_m, stop)
    raise AssertionError("soles meet at the latest when a foot has turned around")
