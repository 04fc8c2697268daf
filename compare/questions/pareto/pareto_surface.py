"""Three objectives: least power over a grid of demands on two criteria, each point solved from its neighbours."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import make_axis_label
from compare.drawing.figures import make_axes, use_style
from compare.questions.pareto.competing import CompetingObjective, make_competing_objective
from compare.questions.pareto.front import solve_ends
from compare.questions.question import Answer, Question, Work
from compare.report.document import Figure
from compare.study.task import describe_problem
from nlp_gait.backends.solve import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem


@dataclass(frozen=True, kw_only=True)
class SurfacePoint:
    """Least power for two demands."""

    demanded: tuple[float, float]  #: of each criterion
    values: tuple[float, float]  #: reached, at least that
    power_W: float  #: exact
    violation: float  #: exact total violation
    x: tuple[float, ...]  #: (n,) as plain numbers


class FoundSurface(NamedTuple):
    """Feasible points in the order in which they were solved, and the pairs of demands without a solution."""

    points: tuple[SurfacePoint, ...]
    infeasible: tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class ParetoSurface(Question[FoundSurface]):
    """How does the least power trade against two criteria, from their cheapest to their largest values?"""

    name: ClassVar[str] = "pareto"

    objectives: tuple[str, str]  #: names of the two criteria
    points: int = 40  #: least number of pairs of demands, on a square grid
    starts: int = 5  #: random starts at both ends of the path over the grid
    seed: int = 0  #: of these

    def __post_init__(self) -> None:
        """Validate the criteria; raises as ``make_competing_objective``."""
        for name in self.objectives:
            make_competing_objective(name, self.problem)

    @cached_property
    def criteria(self) -> tuple[CompetingObjective, CompetingObjective]:
        """The objectives next to power."""
        first, second = (make_competing_objective(name, self.problem) for name in self.objectives)
        return first, second

    def drop_demands(self) -> GaitProblem:
        """Return the problem without demands on the criteria."""
        first, second = self.criteria
        return second.drop_demand(first.drop_demand(self.problem))

    def find(self, work: Work) -> Iterator[FoundSurface]:
        first, second = self.criteria
        problem, solver = self.drop_demands(), work.solver()
        side = math.ceil(math.sqrt(self.points))
        grids = []
        for criterion in self.criteria:
            low, high = solve_ends(problem, criterion, self.starts, self.seed, solver)
            grids.append(np.linspace(low.value, high.value, side).tolist())
        path = [(a, b) for row, b in enumerate(grids[1]) for a in (grids[0] if row % 2 == 0 else reversed(grids[0]))]
        solutions = solve_both_ways(
            [second.demand(first.demand(problem, a), b) for a, b in path],
            starts=self.starts,
            seed=self.seed,
            solver=solver,
            progress=lambda: work.progress("surface"),
        )
        points, infeasible = [], []
        for demanded, solution in zip(path, solutions, strict=True):
            if not solution.converged:
                infeasible.append(demanded)
                continue
            x = problem.check_x(solution.x)
            points.append(
                SurfacePoint(
                    demanded=demanded,
                    values=(first.evaluate(problem, x), second.evaluate(problem, x)),
                    power_W=solution.objective,
                    violation=solution.violation,
                    x=tuple(x.tolist()),
                )
            )
        # A point that exceeds its own demands may satisfy those of another point too, and be the better optimum there.
        better = [min((q for q in points if _satisfies(q, p)), key=lambda q: q.power_W) for p in points]
        points = [replace(q, demanded=p.demanded) for p, q in zip(points, better, strict=True)]
        if not points:
            names = " and ".join(self.objectives)
            raise InputError(f"no pair of demands on {names} of {problem.name} can be satisfied")
        yield FoundSurface(tuple(points), tuple(infeasible))

    def report(self, findings: FoundSurface) -> Answer:
        problem, names = self.drop_demands(), "-".join(self.objectives)
        points, infeasible = findings
        shown = "Least power over the first demand; the colour shows the second one."
        drawing = plot_surface(points, *self.criteria)
        return Answer(
            stem=f"{problem.name}-pareto-{names}",
            title=f"{problem.name}: least power for two demands",
            verdict=(f"{len(points)} of {len(points) + len(infeasible)} pairs of demands can be satisfied.",),
            parts=(Figure(name=f"{problem.name}-surface-{names}", caption=shown, drawing=drawing),),
            data={
                **describe_problem(problem),
                "criteria": [{"name": criterion.name, "unit": criterion.unit} for criterion in self.criteria],
                "points": [asdict(point) for point in points],
                "infeasible": [list(demanded) for demanded in infeasible],
            },
        )


def _satisfies(point: SurfacePoint, other: SurfacePoint) -> bool:
    """Whether a point satisfies the demands of another one."""
    reached = all(value >= demand for value, demand in zip(point.values, other.demanded, strict=True))
    return reached or point.demanded == other.demanded


def plot_surface(points: tuple[SurfacePoint, ...], first: CompetingObjective, second: CompetingObjective) -> Drawing:
    """Plot the power over the first criterion, in lines of equal demand on the second one."""
    with use_style():
        figure, axes = make_axes(5.6, 3.4)
        levels = sorted({p.demanded[1] for p in points})
        norm = Normalize(levels[0], levels[-1] if levels[-1] > levels[0] else levels[0] + 1.0)
        colours = matplotlib.colormaps["viridis"]
        for level in levels:
            line = sorted((p.values[0], p.power_W) for p in points if p.demanded[1] == level)
            axes.plot(*zip(*line, strict=True), "o-", color=colours(0.9 * norm(level)), markersize=3)
        axes.set_xlabel(make_axis_label(first.name, first.unit))
        axes.set_ylabel("least power [W]")
        axes.set_ylim(bottom=0.0)
        shades = ListedColormap(colours(np.linspace(0.0, 0.9, 256)))
        bar = figure.colorbar(ScalarMappable(norm, shades), ax=axes)
        bar.set_label(f"at least this {make_axis_label(second.name, second.unit)}")
    return figure
