"""Cheapest walking cycles along an axis, and their simulation in the engine."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from compare.questions.question import Work
from compare.questions.sweep import SweepPoint
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan


@dataclass(frozen=True, kw_only=True, eq=False)
class Gait:
    """Cheapest cycle at one point of the axis."""

    point: SweepPoint  #: as the sweep found it, with the violated constraints where there is no feasible cycle
    result: Result  #: problem and x at this point
    indexes: Mapping[str, float]  #: exact performance indexes
    walk: Walk | None = None  #: in the engine; None without a simulation

    @property
    def at(self) -> float:
        """Value on the axis."""
        return next(iter(self.point.at.values()))

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "at": dict(self.point.at),
            "feasible": self.point.feasible,
            "status": self.point.status,
            "x": dict(self.point.x),
            "indexes": dict(self.indexes),
            "walk": None if self.walk is None else asdict(self.walk),
        }


def make_gait(problem: GaitProblem, point: SweepPoint) -> Gait:
    """Return the gait of a point of the axis."""
    placed = problem.place(point.at)
    x = placed.check_x(point.x)
    indexes = build_exact_model(placed).at(x, placed.p).indexes
    return Gait(point=point, result=Result(problem=placed, x=x), indexes=indexes)


def simulate_walk(result: Result, steps: int, drive: Drive, work: Work) -> Walk:
    """Simulate so many steps of a gait; raises MissingExtraError without MuJoCo."""
    inputs = {**fingerprint(result.problem), "x": result.x.tolist(), "steps": steps, "drive": repr(drive)}
    return work.compute(Walk, "walk-{key}", inputs, partial(_simulate_walk, result, steps, drive))


def _simulate_walk(result: Result, steps: int, drive: Drive) -> Walk:
    plan = make_plan(result, steps)
    return measure_walk(plan, simulate_plan(plan, drive=drive), drive, steps)


def describe_end(walk: Walk) -> str:
    """Return in words whether the robot stayed up."""
    fell_at_s = walk.measurements.fell_at_s
    return "walks" if fell_at_s is None else f"falls at {fell_at_s:.2f} s"
