"""Three objectives: least power over a grid of demands on two criteria, each point solved from its neighbours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure as Drawing

from compare.drawing.figures import new_figure, style
from compare.drawing.labels import axis_label
from compare.questions.answer import Answer
from compare.questions.pareto.competing import CompetingObjective, competing_objective
from compare.questions.pareto.front import front_ends
from compare.report.document import Figure
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import describe_problem
from nlp_gait.backends.optima.continuation import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import Progress, ignore_progress


@dataclass(frozen=True, kw_only=True)
class SurfacePoint:
    """Least power for two demands.

    Attributes:
        demanded: of each criterion.
        values: reached, at least that.
        power_W: exact.
        violation: exact total violation.
        x: (n,) as plain numbers.
    """

    demanded: tuple[float, float]
    values: tuple[float, float]
    power_W: float
    violation: float
    x: tuple[float, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """Feasible points of the grid; where two demands cannot be met together there is none.

    Attributes:
        problem: with its demands on both criteria dropped.
        criteria: two.
        points: in the order in which they were solved.
        infeasible: demands that no solution was found for.
    """

    problem: GaitProblem
    criteria: tuple[CompetingObjective, CompetingObjective]
    points: tuple[SurfacePoint, ...]
    infeasible: tuple[tuple[float, float], ...]


def pareto_surface(
    problem: GaitProblem,
    names: Sequence[str],
    *,
    points: int,
    starts: int,
    seed: int,
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> Surface:
    """Least power over a square grid of at least this many points, from the cheapest values of both criteria to the largest.

    Args:
        problem: of the surface.
        names: of two criteria.
        points: least number of pairs of demands.
        starts: random starts at both ends of the walk over the grid.
        seed: of these.
        store: of finished results; None stores nothing.
        progress: told after each solve.
    """
    first, second = (competing_objective(name, problem) for name in names)
    free = second.freed(first.freed(problem))
    store = store or Store()
    store.report_changes("pareto", free, objectives=list(names), points=points, starts=starts, seed=seed)
    solver = store_runs(store)
    side = math.ceil(math.sqrt(points))
    grids = []
    for beside in (first, second):
        low, high = front_ends(free, beside, starts, seed, solver)
        grids.append(np.linspace(low.value, high.value, side).tolist())
    walk = [(a, b) for row, b in enumerate(grids[1]) for a in (grids[0] if row % 2 == 0 else reversed(grids[0]))]
    limited = [second.limited(first.limited(free, a), b) for a, b in walk]
    solutions = solve_both_ways(limited, starts=starts, seed=seed, solver=solver, progress=lambda: progress("surface"))
    found, infeasible = [], []
    for at, solution in zip(walk, solutions, strict=True):
        if not solution.converged:
            infeasible.append(at)
            continue
        x = free.check_x(solution.x)
        found.append(
            SurfacePoint(
                demanded=at,
                values=(first.value(free, x), second.value(free, x)),
                power_W=solution.objective,
                violation=solution.violation,
                x=tuple(x.tolist()),
            )
        )
    # A point that meets more than is demanded of another one answers that demand too, and may be the better optimum.
    better = [min((q for q in found if _meets(q, p)), key=lambda q: q.power_W) for p in found]
    found = [replace(q, demanded=p.demanded) for p, q in zip(found, better, strict=True)]
    if not found:
        raise InputError(f"no pair of demands on {names[0]} and {names[1]} of {problem.name} can be met")
    return Surface(problem=free, criteria=(first, second), points=tuple(found), infeasible=tuple(infeasible))


def _meets(point: SurfacePoint, other: SurfacePoint) -> bool:
    """Whether a point is at least as good as another one in both criteria, or has its demands."""
    reached = all(value >= demand for value, demand in zip(point.values, other.demanded, strict=True))
    return reached or point.demanded == other.demanded


def surface_answer(surface: Surface) -> Answer:
    """Least power over the grid of demands."""
    problem, criteria = surface.problem, surface.criteria
    names = "-".join(criterion.name for criterion in criteria)
    met, all_pairs = len(surface.points), len(surface.points) + len(surface.infeasible)
    shown = "Least power over the first demand; the colour says the second one."
    figure = Figure(name=f"{problem.name}-surface-{names}", caption=shown, drawing=surface_figure(surface))
    return Answer(
        stem=f"{problem.name}-pareto-{names}",
        title=f"{problem.name}: least power for two demands",
        verdict=(f"{met} of {all_pairs} pairs of demands can be met.",),
        parts=(figure,),
        data={
            **describe_problem(problem),
            "criteria": [{"name": criterion.name, "unit": criterion.unit} for criterion in criteria],
            "points": [asdict(point) for point in surface.points],
            "infeasible": [list(at) for at in surface.infeasible],
        },
    )


def surface_figure(surface: Surface) -> Drawing:
    """Lines of equal demand on the second criterion, coloured by it: power over the first one."""
    first, second = surface.criteria
    with style():
        figure = new_figure(5.6, 3.4)
        axes = figure.subplots()
        levels = sorted({p.demanded[1] for p in surface.points})
        norm = Normalize(levels[0], levels[-1] if levels[-1] > levels[0] else levels[0] + 1.0)
        colours = matplotlib.colormaps["viridis"]
        for level in levels:
            line = sorted((p.values[0], p.power_W) for p in surface.points if p.demanded[1] == level)
            axes.plot(*zip(*line, strict=True), "o-", color=colours(0.9 * norm(level)), markersize=3)
        axes.set_xlabel(axis_label(first.name, first.unit))
        axes.set_ylabel("least power [W]")
        axes.set_ylim(bottom=0.0)
        shades = ListedColormap(colours(np.linspace(0.0, 0.9, 256)))
        bar = figure.colorbar(ScalarMappable(norm, shades), ax=axes)
        bar.set_label(f"at least this {axis_label(second.name, second.unit)}")
    return figure
