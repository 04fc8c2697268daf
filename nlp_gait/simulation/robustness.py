"""Disturbances that a gait survives: pushes, slippery floors, wrong masses, slopes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.simulate import Conditions, Push, simulate_plan

DIRECTIONS = {"forward": (1, 0), "backward": (-1, 0), "left": (0, 1), "right": (0, -1)}
PUSH_STEP, LARGEST_PUSH = 0.1, 3.0  # [N s]
SLOPE_STEP, LARGEST_SLOPE = 1.0, 20.0  # [degrees]
FRICTIONS = tuple(round(0.1 * k, 1) for k in range(3, 11))
MASS_FACTORS = (0.9, 1.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Robustness:
    """Disturbances that a gait survives; a fall while settling counts."""

    undisturbed: bool  # whether it survives without any
    # by direction, the largest impulse on the torso below the first one that makes it fall
    push_Ns: Mapping[str, float]
    # by the direction in which the floor rises, the largest slope below the first one that makes it fall
    slope_deg: Mapping[str, float]
    friction: Mapping[float, bool]  # by coefficient, whether it survives
    mass_factor: Mapping[float, bool]  # by factor on all masses, whether it survives


def measure_robustness(plan: Plan, drive: Drive | None = None) -> Robustness:
    """Increase each disturbance alone until the robot falls; raises MissingExtraError without MuJoCo."""

    def survives(conditions: Conditions) -> bool:
        return simulate_plan(plan, conditions, drive).fell_at_s is None

    def push(x: float, y: float) -> Conditions:
        return Conditions(push=Push(impulse_Ns=(x, y)))

    def slope(x: float, y: float) -> Conditions:
        return Conditions(slope_rad=(math.radians(x), math.radians(y)))

    def find_largest(make: Callable[[float, float], Conditions], step: float, most: float) -> dict[str, float]:
        found = {}
        for direction, (x, y) in DIRECTIONS.items():
            steps = 1
            while steps * step <= most and survives(make(x * steps * step, y * steps * step)):
                steps += 1
            found[direction] = round((steps - 1) * step, 9)
        return found

    return Robustness(
        undisturbed=survives(Conditions()),
        push_Ns=find_largest(push, PUSH_STEP, LARGEST_PUSH),
        slope_deg=find_largest(slope, SLOPE_STEP, LARGEST_SLOPE),
        friction={value: survives(Conditions(friction=value)) for value in FRICTIONS},
        mass_factor={value: survives(Conditions(mass_factor=value)) for value in MASS_FACTORS},
    )
