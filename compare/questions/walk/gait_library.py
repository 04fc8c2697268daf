"""A library of cheapest cycles over a grid, and how good the gaits between its points are."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from compare.analysis.units import with_unit
from compare.questions.question import Answer, Question, Work, make_table
from compare.questions.sweep import Axis, Sweep, SweepPoint
from compare.study.task import describe_problem
from nlp_gait.backends.identity import fingerprint
from nlp_gait.backends.optima.gait_library import LibraryGait, LibraryPoint, make_library
from nlp_gait.backends.optima.sensitivities import SensitivityTable, tabulate_sensitivities
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem


@dataclass(frozen=True, kw_only=True)
class MiddleGait:
    """A gait in the middle between the points of a library, and the optimum there."""

    at: dict[str, float]  #: value of each axis
    objective: float  #: of the interpolated gait, exact
    violation: float  #: its largest violation, in the constraint's unit
    violated: str  #: name of this constraint; empty if the gait is feasible
    optimum: float | None  #: objective of the optimum solved there; None if none was found


class FoundLibrary(NamedTuple):
    """Optima of the grid, and gaits between them."""

    points: list[LibraryPoint]
    judged: list[MiddleGait]


@dataclass(frozen=True, kw_only=True, eq=False)
class LibraryOfGaits(Question[FoundLibrary]):
    """Which gaits are the cheapest over a grid, how do they change, and how good is what lies between?"""

    name: ClassVar[str] = "library"

    axes: Sequence[Axis]  #: with increasing values
    starts: int = 5  #: random starts of IPOPT at both ends of the path through the grid
    seed: int = 0  #: of these starts

    def __post_init__(self) -> None:
        """Validate the grid before the work; raises InputError for values that do not increase, and as ``Sweep``."""
        make_library(self.problem, self._values, [])
        self._make_sweep()

    @property
    def _values(self) -> dict[str, tuple[float, ...]]:
        return {axis.name: axis.values for axis in self.axes}

    def _make_sweep(self) -> Sweep:
        return Sweep(problem=self.problem, axes=self.axes, starts=self.starts, seed=self.seed)

    @property
    def inputs(self) -> dict[str, Any]:
        return {**super().inputs, "axes": {name: list(values) for name, values in self._values.items()}}

    @property
    def total(self) -> int:
        points, cells = (int(np.prod([len(axis.values) - less for axis in self.axes])) for less in (0, 1))
        return 3 * points + cells

    def find(self, work: Work) -> Iterator[FoundLibrary]:
        *_, grid = self._make_sweep().find(work)
        found = FoundLibrary([], [])
        for point in grid:
            placed = self.problem.place(point.at)
            inputs = {**fingerprint(placed), "x": list(point.x.values()), "axes": list(self._values)}
            differentiate = partial(_differentiate, self.problem, point, inputs["axes"])
            found.points.append(work.compute(LibraryPoint, "slopes-{key}", inputs, differentiate))
            work.progress("")
            yield found
        library = make_library(self.problem, self._values, found.points)
        middles = [[(a + b) / 2 for a, b in itertools.pairwise(values)] for values in library.axes.values()]
        for values in itertools.product(*middles):
            at = dict(zip(library.axes, values, strict=True))
            if library.covers(**at):
                gait = library.interpolate(**at)
                inputs = {**fingerprint(gait.result.problem), "x": gait.result.x.tolist()}
                found.judged.append(work.compute(MiddleGait, "middle-{key}", inputs, partial(_judge, gait, at)))
            work.progress("")
            yield found

    def report(self, findings: FoundLibrary) -> Answer:
        points, judged = findings
        unit, axes = self.problem.objective.unit, list(self._values)
        at: dict[str, Callable[[Any], str]] = {axis: partial(_format_place, axis) for axis in axes}
        optima: dict[str, Callable[[LibraryPoint], str]] = {
            **at,
            self.problem.objective.name: lambda point: with_unit(point.objective if point.feasible else None, unit),
        }
        between: dict[str, Callable[[MiddleGait], str]] = {
            **at,
            "interpolated": lambda gait: with_unit(gait.objective, unit),
            "worse than the optimum": lambda gait: f"{100 * self._find_excess(gait):.3f} %" if gait.optimum else "-",
            "largest violation": lambda gait: f"{gait.violation:.1e}, {gait.violated}" if gait.violated else "none",
        }
        feasible = sum(not gait.violated for gait in judged)
        excesses = [self._find_excess(gait) for gait in judged if gait.optimum]
        verdict = [f"{sum(point.feasible for point in points)} of {len(points)} points have an optimum."]
        if excesses:
            verdict.append(
                f"Of {len(judged)} gaits in the middle between points {feasible} are feasible; their objective is worse than "
                f"the optimum there by {100 * np.median(excesses):.3f} % in the median and {100 * max(excesses):.3f} % at most."
            )
        stem = f"{self.problem.name}-library"
        return Answer(
            stem=stem,
            title=f"{self.problem.name}: library of gaits over {' and '.join(axes)}",
            verdict=verdict,
            parts=[
                make_table("Optima of the library", points, optima),
                make_table("Gaits in the middle between its points, judged by the exact functions", judged, between),
                f"nlp_gait.load_library('{stem}.json').interpolate({', '.join(f'{axis}=...' for axis in axes)}) returns a gait.",
            ],
            data={
                **describe_problem(self.problem),
                "axes": self._values,
                "points": [asdict(point) for point in points],
                "judged": [asdict(gait) for gait in judged],
            },
        )

    def _find_excess(self, gait: MiddleGait) -> float:
        """Share of the optimum by which an interpolated gait is worse."""
        assert gait.optimum is not None
        return self.problem.objective.sign * (gait.objective - gait.optimum) / abs(gait.optimum)

    def failures(self, findings: FoundLibrary) -> list[str]:
        return [] if any(point.feasible for point in findings.points) else ["no point of the grid has an optimum"]


def _format_place(axis: str, row: LibraryPoint | MiddleGait) -> str:
    return f"{row.at[axis]:g}"


def _differentiate(problem: GaitProblem, point: SweepPoint, axes: Sequence[str]) -> LibraryPoint:
    """Return a point with the derivatives of its optimum, which is solved again from there."""
    slopes: dict[str, dict[str, float | None]] = {axis: dict.fromkeys(problem.names) for axis in axes}
    x, objective = point.x, point.objective
    if point.feasible:
        placed = problem.place(point.at)
        solution = solve(placed, x0=placed.check_x(point.x), workers=1)
        if solution.converged:
            x, objective = solution.x, solution.objective
            try:
                table = tabulate_sensitivities(placed, solution)
            except InputError:  # no derivatives at this optimum
                pass
            else:
                slopes = {axis: {name: _read_slope(table, name, axis) for name in problem.names} for axis in axes}
    return LibraryPoint(at=point.at, feasible=point.feasible, objective=objective, x=x, slopes=slopes)


def _read_slope(table: SensitivityTable, name: str, axis: str) -> float | None:
    """Return the change of a variable per unit of an axis, of whose two bounds one acts if it is no parameter itself."""
    known = {parameter for parameter, _ in table.parameters}
    ends = (axis,) if axis in known else (f"{axis}.lower", f"{axis}.upper")
    value = sum(table.value(name, end) for end in ends)
    return value if np.isfinite(value) else None


def _judge(gait: LibraryGait, at: dict[str, float]) -> MiddleGait:
    solution = solve(gait.result.problem, x0=gait.result.x, workers=1)
    worst = gait.violated[0] if gait.violated else None
    return MiddleGait(
        at=at,
        objective=gait.objective,
        violation=worst.violation if worst else 0.0,
        violated=worst.name if worst else "",
        optimum=solution.objective if solution.converged else None,
    )
