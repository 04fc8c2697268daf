"""Effects of balance feedback if the world or the robot differs from the plan."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from benchmarks.engine.agreement import STEPS
from benchmarks.engine.gaits import DIRECTIONS, optimal_cycles
from benchmarks.engine.markdown import cells, header
from benchmarks.engine.sensitivity import SPEED
from nlp_gait.simulation.balance.controller import Balance
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import Conditions, Push, simulate_plan

SLOPE = math.radians(3.0)
IMPULSE = 1.0  # [N s]
CONDITIONS: Mapping[str, Conditions] = {
    "as planned": Conditions(),
    **{
        f"floor rises 3 degrees {direction}": Conditions(slope_rad=(x * SLOPE, y * SLOPE))
        for direction, (x, y) in DIRECTIONS.items()
    },
    "friction 0.4": Conditions(friction=0.4),
    "mass +5 %": Conditions(mass_factor=1.05),
    "drive stiffness -30 %": Conditions(stiffness_factor=0.7),
    "drive stiffness +30 %": Conditions(stiffness_factor=1.3),
    **{
        f"push of {IMPULSE:g} N s {direction}": Conditions(push=Push(impulse_Ns=(x * IMPULSE, y * IMPULSE)))
        for direction, (x, y) in DIRECTIONS.items()
    },
}


def simulate_walk(steps: int, conditions: Conditions, feedback: Balance | None) -> Walk:
    """Simulate so many steps of the cheapest cycle at ``SPEED``."""
    plan, drive = make_plan(optimal_cycles((SPEED,))[SPEED], steps), Drive(feedback=feedback)
    return measure_walk(plan, simulate_plan(plan, conditions, drive), drive, steps)


def format_walk(walk: Walk) -> tuple[str, str, str]:
    """Format steps done, energy, and the share of the distance."""
    energy, distance = walk.engine_J_per_planned_m, walk.walked_m
    return (
        f"{walk.steps_done} of {walk.steps}",
        "-" if energy is None else f"{energy:.1f}",
        "-" if distance is None else f"{distance / walk.planned_m:.3f}",
    )


def disturbed() -> Iterator[str]:
    """Ten steps of the cheapest cycle at 0.05 m/s, in open loop and with balance feedback: J per planned metre."""
    columns = ("steps", "J/m", "distance")
    yield header("condition", *(f"open loop: {columns[0]}", *columns[1:]), *(f"feedback: {columns[0]}", *columns[1:]))
    for label, conditions in CONDITIONS.items():
        yield cells(
            label, *(text for own in (None, Balance()) for text in format_walk(simulate_walk(STEPS, conditions, own)))
        )
