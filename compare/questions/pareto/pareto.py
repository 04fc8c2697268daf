"""Power against a balance margin or speed: the true front, its knees, and how near evolutionary searches come to it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import make_axis_label
from compare.drawing.figures import COLOURS, make_figure, use_style
from compare.questions.pareto.front import (
    CompetingObjective,
    FrontPoint,
    Knee,
    find_knees,
    make_competing_objective,
    solve_front,
)
from compare.questions.question import Answer, Question, Work, make_record_table, make_table
from compare.report.document import Figure, Part
from compare.study.references import find_reference
from compare.study.run import describe_problem
from metaheuristics.multi_objective import check_budgets, make_front_algorithm, minimize_many
from nlp_gait.backends.exact import identify_problem
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem

# Reference point of the hypervolume, with the ranges of the true front as 1: a tenth beyond its worst values.
REFERENCE = 1.1
SEARCHES = {"NSGA2": ("NSGA-II", COLOURS["ga"]), "CMOPSO": ("CMOPSO", COLOURS["pso"])}  # names in print and colours
MARKS = ("x", "+", ".")

Spread = tuple[float, float, float]
"""Least, median and greatest value over the runs."""


def to_arrays(points: Sequence[FrontPoint | Knee]) -> Array:
    """Return criterion and power of points (2, P)."""
    return np.array([(point.value, point.power_W) for point in points]).reshape(-1, 2).T


class Scale:
    """Power and criterion as numbers to be minimised, 0 at the best and 1 at the worst value on the true front."""

    def __init__(self, front: Sequence[FrontPoint]) -> None:
        self.values, self.powers = to_arrays(front)
        self.best = np.array([self.powers.min(), self.values.max()])
        self.ranges = np.array([np.ptp(self.powers), -np.ptp(self.values)])

    def __call__(self, values: Array, powers: Array) -> Array:
        """Return (P, 2) from criterion (P,) and power (P,)."""
        return np.asarray((np.column_stack([powers, values]) - self.best) / self.ranges)

    def compute_excess(self, values: Array, powers: Array) -> Array:
        """Return the powers above the straight lines between the front's points, relative (P,)."""
        return np.asarray(powers / np.interp(values, self.values, self.powers) - 1.0)


class PowerAndCompeting:
    """The compiled objective with a criterion next to the power; see ``metaheuristics.multi_objective.ManyObjectives``."""

    def __init__(self, objective: CompiledObjective, criterion: CompetingObjective, scale: Scale) -> None:
        self.names, self.lower, self.upper, self.count = objective.names, objective.lower, objective.upper, 2
        self._objective, self._criterion, self._scale = objective, criterion, scale

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return objectives (P, 2) and violations (P,)."""
        power, violation = self._objective(X)
        return self._scale(self._criterion.evaluate_many(self._objective, X), power), violation

    def list_points(self, X: Array) -> tuple[FrontPoint, ...]:
        """Return feasible candidates (P, n) as points."""
        values, powers = self._criterion.evaluate_many(self._objective, X), self._objective(X)[0]
        rows = zip(values.tolist(), powers.tolist(), X.tolist(), strict=True)
        return tuple(FrontPoint(value=v, power_W=w, violation=0.0, x=tuple(x)) for v, w, x in rows)


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchFront:
    """Feasible nondominated points of one run after a budget."""

    solver: str  #: name of the search
    budget: int  #: evaluations allowed
    points: tuple[FrontPoint, ...]


@dataclass(frozen=True, kw_only=True)
class Quality:
    """All runs of one search with one budget."""

    solver: str  #: name of the search
    budget: int  #: evaluations
    runs: int  #: number
    empty: int  #: runs without a feasible point; they count as hypervolume 0 and are left out of what follows
    hypervolume: Spread  #: share of the true front's, with both ranges as 1 and the reference 1.1
    igd: Spread | None  #: mean distance from a point of the true front to the nearest one found
    gap: Spread | None  #: mean power above the true front's at an equal criterion, relative


class FoundFront(NamedTuple):
    """The true front with its knees, and what the searches found."""

    front: tuple[FrontPoint, ...]
    knees: tuple[Knee, ...]  #: of the front
    searches: tuple[SearchFront, ...] = ()  #: fronts of all runs
    qualities: tuple[Quality, ...] = ()  #: a row for each search and budget
    #: least power of the searches' points above the straight lines between the front's points, relative; None without searches
    least_gap: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Pareto(Question[FoundFront]):
    """How does the least power trade against one criterion, and how near do searches come?"""

    name: ClassVar[str] = "pareto"

    against: str = "dbm_y_mean"  #: name of the criterion next to power
    points: int = 40  #: of the front
    starts: int = 5  #: random starts at some of its points
    #: rising numbers of evaluations by algorithm; none for the front alone
    searches: Mapping[str, Sequence[int]] = field(default_factory=dict)
    runs: int = 11  #: of each algorithm; run k has the seed ``seed + k``
    seed: int = 0  #: of starts and of the first run

    def __post_init__(self) -> None:
        """Validate criterion and searches.

        Raises:
            UnknownNameError: an unknown criterion.
            InputError: the problem has nothing to trade.
            SearchError: an unknown algorithm, a budget that is not allowed, or pymoo is not installed.
        """
        make_competing_objective(self.against, self.problem)
        for algorithm, budgets in self.searches.items():
            check_budgets(make_front_algorithm(algorithm), budgets)

    @cached_property
    def criterion(self) -> CompetingObjective:
        """The objective next to power."""
        return make_competing_objective(self.against, self.problem)

    def find(self, work: Work) -> Iterator[FoundFront]:
        criterion, problem = self.criterion, self.criterion.drop_demand(self.problem)
        best = list(find_reference(identify_problem(self.problem)).x)
        effort: dict[str, Any] = {"points": self.points, "starts": self.starts, "seed": self.seed, "known": best}
        inputs = {**identify_problem(problem), "criterion": criterion.name, **effort}
        solver, progress = IpoptSettings(), work.progress
        solve = partial(solve_front, problem, criterion, **effort, solver=solver, progress=progress)
        front = work.compute(tuple[FrontPoint, ...], f"front-{criterion.name}", inputs, solve)
        if not self.searches:
            yield FoundFront(front, find_knees(front))
            return
        searches = self._run_searches(problem, front, work)
        points = [point for search in searches for point in search.points]
        least_gap = float(Scale(front).compute_excess(*to_arrays(points)).min()) if points else None
        yield FoundFront(front, find_knees(front), searches, tuple(compute_qualities(front, searches)), least_gap)

    def _run_searches(self, problem: GaitProblem, front: Sequence[FrontPoint], work: Work) -> tuple[SearchFront, ...]:
        """Return the fronts of all runs on a problem without the criterion's demand; each finished run is stored."""
        scale = Scale(front)  # keeps either objective from dominating an algorithm's distances
        objectives = PowerAndCompeting(compile_objective(problem), self.criterion, scale)
        ranges = [*scale.best.tolist(), *scale.ranges.tolist()]
        identity = {**identify_problem(problem), "criterion": self.criterion.name, "scale": ranges}
        fronts: tuple[SearchFront, ...] = ()
        for name, budgets in self.searches.items():
            settings = repr(make_front_algorithm(name))
            for run in range(self.runs):
                seed = self.seed + run
                inputs = {**identity, "budgets": list(budgets), "algorithm": settings, "seed": seed}
                search = partial(_run_search, objectives, name, budgets, seed)
                fronts += work.compute(tuple[SearchFront, ...], f"{name.lower()}-{run}", inputs, search)
                work.progress(f"{name}, run {run}")
        return fronts

    def report(self, findings: FoundFront) -> Answer:
        problem, criterion = self.problem, self.criterion
        stem = f"{problem.name}-front-{criterion.name}"
        caption = "The front as a line, its knees, and what the searches found; its cheap part on the right."
        value = f"{criterion.name}_{criterion.unit.replace('/', '_')}"
        rows = [
            {value: p.value, "power_W": p.power_W, "price": p.price, "violation": p.violation}
            | problem.by_name(np.array(p.x))
            for p in findings.front
        ]
        return Answer(
            stem=f"{problem.name}-pareto-{criterion.name}",
            title=f"{problem.name}: power against {criterion.name}",
            parts=(
                *_make_tables(findings, criterion),
                *_report_searches(findings, criterion),
                Figure(name=stem, caption=caption, drawing=plot_front(findings, criterion)),
                make_record_table(stem, rows),
            ),
            data={
                **describe_problem(criterion.drop_demand(problem)),
                "criterion": {"name": criterion.name, "unit": criterion.unit},
                "front": [asdict(point) for point in findings.front],
                "knees": [asdict(knee) for knee in findings.knees],
                "searches": [asdict(row) for row in findings.qualities],
                "least_gap": findings.least_gap,
            },
        )


def _run_search(objectives: PowerAndCompeting, name: str, budgets: Sequence[int], seed: int) -> tuple[SearchFront, ...]:
    snapshots = minimize_many(objectives, make_front_algorithm(name), evaluations=budgets, seed=seed)
    return tuple(
        SearchFront(solver=name, budget=budget, points=objectives.list_points(snapshot.X))
        for budget, snapshot in zip(budgets, snapshots, strict=True)
    )


def parse_searches(texts: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return the budgets by algorithm from ``NSGA2=10000,100000``; none from ``none``; InputError for another text."""
    if list(texts) == ["none"]:
        return {}
    searches: dict[str, tuple[int, ...]] = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            searches[name.strip()] = tuple(int(number) for number in numbers.split(","))
        except ValueError:
            raise InputError(f"--search takes NAME=BUDGET,BUDGET or none, got {text!r}") from None
    return searches


def group_runs(fronts: Sequence[SearchFront]) -> dict[tuple[str, int], list[SearchFront]]:
    """Return the fronts of all runs by search and budget."""
    keys = dict.fromkeys((front.solver, front.budget) for front in fronts)
    return {key: [front for front in fronts if (front.solver, front.budget) == key] for key in keys}


def compute_qualities(front: Sequence[FrontPoint], fronts: Sequence[SearchFront]) -> list[Quality]:
    """Return a row for each search and budget."""
    from pymoo.indicators.hv import HV
    from pymoo.indicators.igd import IGD

    scale = Scale(front)
    true = scale(scale.values, scale.powers)
    hypervolume, distance = HV(ref_point=np.full(2, REFERENCE)), IGD(true)
    whole = float(hypervolume(true))
    rows = []
    for (solver, budget), runs in group_runs(fronts).items():
        ends = [to_arrays(run.points) for run in runs if run.points]
        scaled, empty = [scale(*end) for end in ends], len(runs) - len(ends)
        shares = [float(hypervolume(F)) / whole for F in scaled] + [0.0] * empty
        rows.append(
            Quality(
                solver=solver,
                budget=budget,
                runs=len(runs),
                empty=empty,
                hypervolume=_compute_spread(shares),
                igd=_compute_spread([float(distance(F)) for F in scaled]) if ends else None,
                gap=_compute_spread([float(scale.compute_excess(*end).mean()) for end in ends]) if ends else None,
            )
        )
    return rows


def _compute_spread(numbers: Sequence[float]) -> Spread:
    return float(np.min(numbers)), float(np.median(numbers)), float(np.max(numbers))


def _make_tables(findings: FoundFront, criterion: CompetingObjective) -> tuple[Part, ...]:
    """Some points of the front, and its knees."""
    front, unit, per = findings.front, criterion.unit, f"W per {criterion.unit}"
    shown = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    place: dict[str, Any] = {
        criterion.name: lambda p: f"{p.value:z.5f} {unit}",
        "power": lambda p: f"{p.power_W:.5f} W",
    }
    bend: dict[str, Any] = {
        "turn": lambda k: f"{k.turn_deg:z.0f} degrees",
        "price before": lambda k: f"{k.price_before:.4g} {per}",
        "price after": lambda k: f"{k.price_after:.4g} {per}",
    }
    title = f"Front of power against {criterion.name}, {len(front)} points, {len(shown)} shown"
    turns = "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1"
    return (
        make_table(title, shown, place | {"price": lambda p: f"{p.price:.4g} {per}"}),
        make_table(turns, findings.knees, place | bend),
    )


def _report_searches(findings: FoundFront, criterion: CompetingObjective) -> tuple[Part, ...]:
    if findings.least_gap is None:
        return ()
    columns: dict[str, Any] = {
        "solver": lambda q: q.solver,
        "evaluations": lambda q: f"{q.budget:,}",
        "hypervolume, of the front's": lambda q: _format_spread(q.hypervolume, 100, " %"),
        "IGD": lambda q: _format_spread(q.igd, 1, ""),
        "mean power above the front": lambda q: _format_spread(q.gap, 100, " %"),
    }
    return (
        make_table("Searches: median over runs (least to greatest)", findings.qualities, columns),
        f"The nearest point of a search is {100 * findings.least_gap:+z.4f} % above the lines between the front's points",
    )


def _format_spread(values: Spread | None, factor: float, unit: str) -> str:
    if values is None:
        return "-"
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"


def plot_front(findings: FoundFront, criterion: CompetingObjective) -> Drawing:
    """Plot the front with its knees and the points of the searches (left), and its lower part (right)."""
    values, powers = to_arrays(findings.front)
    end = np.interp(0.5, (0.0, 1.0), (values[0], values[-1]))
    if findings.knees:
        end = findings.knees[0].value + 0.08 * np.ptp(values)
    top = np.interp(end, values, powers)
    with use_style():
        figure = make_figure(7.2, 3.7)
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            _plot_searches(axes, findings.searches)
            axes.plot(values, powers, "-", color=COLOURS["ipopt"], label=f"IPOPT, {len(values)} points")
            if findings.knees:
                rings = {"markeredgecolor": COLOURS["aco"], "markersize": 9, "markeredgewidth": 1.6}
                axes.plot(*to_arrays(findings.knees), "o", color="none", label="knee", **rings)
            axes.set_xlabel(make_axis_label(criterion.name, criterion.unit))
            axes.locator_params(axis="x", nbins=6)
        left.set(ylabel="power [W]", ylim=(0.0, powers[-1] * 1.06))
        right.set(xlim=(values[0], end), ylim=(powers[0] - 0.08 * (top - powers[0]), top))
        right.set_title("the front's cheap part", loc="left")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _plot_searches(axes: Axes, searches: Sequence[SearchFront]) -> None:
    budgets = sorted({search.budget for search in searches})
    for (solver, budget), runs in sorted(group_runs(searches).items()):
        title, colour = SEARCHES[solver]
        axes.plot(
            *to_arrays([point for run in runs for point in run.points]),
            MARKS[budgets.index(budget) % len(MARKS)],
            color=colour,
            markersize=2.5,
            markeredgewidth=0.5,
            alpha=0.45,
            label=f"{title}, {budget:,} evaluations, {len(runs)} runs",
            rasterized=True,
        )
