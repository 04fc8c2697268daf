"""What a walk of several steps showed in the engine: how far it came, and how straight."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, measure
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.playback import Trace


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """A walk in numbers; distances are those of the point halfway between the feet, from start to rest.

    Attributes:
        steps: planned.
        steps_done: whole steps before a fall; all of them if it fell later or not at all.
        planned_m: distance.
        walked_m: distance forward; None after a fall.
        drift_m: distance to the left; None after a fall.
        heading_deg: direction of the torso at the end, positive to the left; None after a fall.
        model_J_per_m: what the model says: mechanical and heat, for each metre planned.
        engine_J_per_planned_m: of the servos; None after a fall.
        engine_J_per_m: for each metre walked; None after a fall or without progress.
        measurements: as of any playback.
    """

    steps: int
    steps_done: int
    planned_m: float
    walked_m: float | None
    drift_m: float | None
    heading_deg: float | None
    model_J_per_m: float
    engine_J_per_planned_m: float | None
    engine_J_per_m: float | None
    measurements: Measurements

    def course(self) -> dict[str, Any]:
        """As plain data, without the measurements."""
        return {name: value for name, value in asdict(self).items() if name != "measurements"}


def measure_walk(plan: Plan, trace: Trace, drive: Drive, steps: int) -> Walk:
    """Numbers of one simulation of so many steps."""
    measurements = measure(plan, trace, drive)
    planned, (walked, drift) = planned_m(plan), walked_m(trace)
    energy = measurements.measured.total_W * plan.duration_s
    fell = trace.fell_at_s
    return Walk(
        steps=steps,
        steps_done=steps if fell is None else min(steps, math.floor(steps * fell / plan.duration_s)),
        planned_m=planned,
        walked_m=walked if fell is None else None,
        drift_m=drift if fell is None else None,
        heading_deg=math.degrees(float(trace.heading[-1])) if fell is None else None,
        model_J_per_m=measurements.predicted.total_W * plan.duration_s / planned,
        engine_J_per_planned_m=energy / planned if fell is None else None,
        engine_J_per_m=energy / walked if fell is None and walked > 0.0 else None,
        measurements=measurements,
    )


def planned_m(plan: Plan) -> float:
    """Planned way forward of the point halfway between the feet [m]."""
    feet = plan.signals.arrays["left_foot"] + plan.signals.arrays["right_foot"]
    return float(feet[-1, 0] - feet[0, 0]) / 2


def walked_m(trace: Trace) -> tuple[float, float]:
    """Way forward and to the left of the point halfway between the feet, from start to rest [m]."""
    middle = trace.feet.mean(axis=1)
    forward, left = (middle[-1] - middle[0])[:2].tolist()
    return forward, left
