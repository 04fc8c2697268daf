"""What walking costs: the optimal cycle over a range of speeds or of any limit, and how each fares in a physics engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

from compare.questions.sweep.study import Axis, SweepPoint, placed, sweep
from compare.study.store import Store
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode
from nlp_gait.files import replace_nan
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.gaits.biped.cycle import SPEED, SPEED_M_S
from nlp_gait.interrupts import Interrupted
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

CYCLE = "nao-cycle"
CYCLES = (CYCLE, "humanoid-cycle")
SPEEDS_M_S = (0.01, 0.1)  # of NAO


def default_speeds(problem: GaitProblem) -> str:
    """Ten speeds as an axis in text: NAO's, of other robots at the same Froude numbers."""
    (speed,) = (parameter.default for parameter in problem.parameters if parameter.name == SPEED)
    low, high = (speed * limit / SPEED_M_S for limit in SPEEDS_M_S)
    return f"{SPEED}={low:.3g}:{high:.3g}:10"


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
            "walk": None if self.walk is None else asdict(self.walk),
        }


def optimal_gaits(
    spec: ProblemSpec,
    axis: Axis,
    *,
    starts: int,
    seed: int,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> list[Gait]:
    """Optimal cycle at every point of an axis, each from its neighbours, there and back.

    Args:
        spec: of a cycle.
        axis: parameter or variable.
        starts: random starts of IPOPT at both ends, and where no neighbour helps.
        seed: of these starts.
        store: of finished results; None stores nothing.
        progress: told of each solve, twice for each point.

    Raises:
        Interrupted: Ctrl-C; carries the gaits that were found until then.
    """

    def gaits(points: Sequence[SweepPoint]) -> list[Gait]:
        results = [result_of(spec, point) for point in points]
        indexes = [build_exact_model(result.problem).at(result.x, result.problem.p).indexes for result in results]
        return [Gait(found=point, indexes=own) for point, own in zip(points, indexes, strict=True)]

    try:
        return gaits(sweep(spec, [axis], starts=starts, seed=seed, store=store, progress=progress))
    except Interrupted as interrupt:
        raise Interrupted(interrupt.sentence, gaits(cast("list[SweepPoint]", interrupt.partial))) from None


def played(spec: ProblemSpec, gait: Gait, steps: int, drive: Drive, store: Store | None = None) -> Gait:
    """The gait with a playback of this many steps, taken from what is finished; unchanged where no feasible gait was found.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    if not gait.found.feasible:
        return gait
    return replace(gait, walk=walked(result_of(spec, gait.found), steps, drive, store or Store()))


def walked(gait: Result, steps: int, drive: Drive, store: Store) -> Walk:
    """How so many steps of a gait fare in the engine, taken from what is finished.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    inputs = {**fingerprint(gait.problem), "x": gait.x.tolist(), "steps": steps, "drive": repr(drive)}

    def measured() -> dict[str, Any]:
        plan = make_plan(gait, steps)
        return dict(replace_nan(asdict(measure_walk(plan, simulate_plan(plan, drive=drive), drive, steps))))

    return decode(Walk, store.compute("walk-{key}", inputs, measured))


def result_of(spec: ProblemSpec, point: SweepPoint) -> Result:
    """A point of the axis as other commands take it."""
    problem = placed(spec.load(), point.at)
    return Result(problem=problem, x=problem.check_x(point.x))
