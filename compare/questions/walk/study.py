"""What walking costs: the optimal cycle over a range of speeds or of any limit, and how each fares in a physics engine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from compare.questions.sweep.study import Axis, SweepPoint, count_solves, sweep
from compare.study.task import IPOPT, ProblemSpec
from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.interrupts import Interrupted
from nlp_gait.files import csv_text, write_json, write_text
from nlp_gait.problem import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play
from nlp_gait.simulation.walking import Walk, measure_walk

CYCLE = "nao-cycle"
# Indexes that the table lists, with their units in their names.
FIGURES = (
    "power_W",
    "energy_J_per_m",
    "cost_of_transport",
    "speed_m_s",
    "step_length_m",
    "ssp_power_W",
    "dsp_power_W",
    "ssp_dbm_x_min_m",
    "ssp_dbm_y_min_m",
    "ssp_dbm_x_mean_m",
    "ssp_dbm_y_mean_m",
    "dsp_dbm_x_mean_m",
    "dsp_dbm_y_mean_m",
    "touch_down_torque_jump_Nm",
    "lift_off_torque_jump_Nm",
)


@dataclass(frozen=True, kw_only=True)
class Gait:
    """Optimal cycle at one point of the axis.

    Attributes:
        found: as the sweep found it, with the rows in the way where there is none.
        indexes: exact performance figures at its x.
        walk: playback in the engine; None if it was not played.
    """

    found: SweepPoint
    indexes: Mapping[str, float]
    walk: Walk | None = None

    @property
    def at(self) -> float:
        """Value on the axis."""
        return next(iter(self.found.at.values()))

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries and numbers."""
        return {
            "at": dict(self.found.at),
            "feasible": self.found.feasible,
            "status": self.found.status,
            "x": dict(self.found.x),
            "indexes": dict(self.indexes),
            "walk": None if self.walk is None else self.walk.to_json(),
        }


def optimal_gaits(
    spec: ProblemSpec, axis: Axis, *, starts: int, seed: int, progress: Callable[[], None] | None = None
) -> list[Gait]:
    """Optimal cycle at every point of an axis, each from its neighbours, there and back.

    Args:
        spec: of a cycle.
        axis: parameter or variable.
        starts: random starts of IPOPT at both ends, and where no neighbour helps.
        seed: of these starts.
        progress: called twice for each point.

    Raises:
        Interrupted: Ctrl-C; carries the gaits that were found until then.
    """

    def gaits(points: Sequence[SweepPoint]) -> list[Gait]:
        return [Gait(found=point, indexes=_indexes(result_of(spec, point))) for point in points]

    try:
        return gaits(sweep(spec, [axis], starts=starts, seed=seed, progress=progress))
    except Interrupted as interrupt:
        raise Interrupted(interrupt.sentence, gaits(cast("list[SweepPoint]", interrupt.partial))) from None


def solves(axis: Axis) -> int:
    """How often ``optimal_gaits`` calls ``progress``."""
    return count_solves([axis], IPOPT)


def played(spec: ProblemSpec, gait: Gait, steps: int) -> Gait:
    """The gait with its playback of so many steps; as it is where none was found.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    if not gait.found.feasible:
        return gait
    drive, plan = Drive(), plan_of(result_of(spec, gait.found), steps)
    return replace(gait, walk=measure_walk(plan, play(plan, drive=drive), drive, steps))


def result_of(spec: ProblemSpec, point: SweepPoint) -> Result:
    """A point of the axis as other commands take it."""
    problem = spec.load()
    for name, value in point.at.items():
        problem = problem.fix(**{name: value}) if name in problem.names else problem.with_values(**{name: value})
    return Result(problem=problem, x=np.array([point.x[name] for name in problem.names]))


def _indexes(result: Result) -> dict[str, float]:
    return exact_model(result.problem).at(result.x, result.problem.p).indexes


def walk_csv(gaits: Sequence[Gait]) -> str:
    """Table of all gaits, one row each, units in the header."""
    table: list[Sequence[object]] = []
    (name,) = gaits[0].found.at
    names = list(gaits[0].found.x)
    head = [f"at {name}" if name in names or name in FIGURES else name, "feasible"]
    measured = ("steps", "steps_done", "planned_m", "walked_m", "drift_m", "heading_deg", "energy_J_per_m")
    powers = ("largest_tilt_deg", "tracking_max_rad", "mechanical_W", "heat_W")
    table.append([*head, *FIGURES, *names, *(f"engine_{key}" for key in (*measured, *powers)), "status"])
    for gait in gaits:
        walk = gait.walk
        engine: list[Any] = [None] * (len(measured) + len(powers))
        if walk is not None:
            found = walk.measurements
            power = found.measured
            engine = [getattr(walk, key) for key in measured]
            engine += [found.largest_tilt_deg, found.tracking_max_rad, power.mechanical_W, power.heat_W]
        cells = [*(gait.indexes[key] for key in FIGURES), *gait.found.x.values(), *engine]
        numbers = ["" if value is None else repr(value) for value in cells]
        table.append([repr(gait.at), str(gait.found.feasible).lower(), *numbers, gait.found.status])
    return csv_text(table)


def write_walk(folder: Path, spec: ProblemSpec, gaits: Sequence[Gait]) -> list[Path]:
    """Write the table and, for the other commands, each gait as a result; returns the paths."""
    table = folder / f"{CYCLE}-walk.csv"
    write_text(table, walk_csv(gaits))
    written = [table]
    (axis,) = gaits[0].found.at
    for gait in gaits:
        if gait.found.feasible:
            result = result_of(spec, gait.found)
            problem = result.problem
            written.append(folder / f"{CYCLE}-{axis}-{gait.at:g}.json")
            data = {"problem": problem.name, "options": dict(problem.options), "parameters": dict(problem.values)}
            write_json(written[-1], {**data, "x": problem.by_name(result.x)})
    return written
