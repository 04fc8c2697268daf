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
from compare.questions.pareto import front as front_module
from compare.questions.pareto.competing import CompetingObjective, make_competing_objective
from compare.questions.pareto.front import FrontPoint, Knee, find_knees, select_front, solve_front, solve_point
from compare.questions.question import Answer, Question, Work, make_record_table, make_table
from compare.report.document import Figure, Part
from compare.study.references import find_reference
from compare.study.task import describe_problem
from metaheuristics.multi_objective import MultiObjective, check_budgets, make_front_algorithm, minimize_many
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint, identify_problem
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress

# Reference point of the hypervolume, with the ranges of the true front as 1: a tenth beyond its worst values.
REFERENCE = 1.1
MOST_CHALLENGES = 1000
SEARCHES = {"NSGA2": ("NSGA-II", COLOURS["ga"]), "CMOPSO": ("CMOPSO", COLOURS["pso"])}  # names in print and colours
MARKS = ("x", "+", ".")

Spread = tuple[float, float, float]
"""Least, median and greatest value over the runs."""


class Scale:
    """Power and criterion as numbers to be minimised, 0 at the best and 1 at the worst value on the true front."""

    def __init__(self, front: Sequence[FrontPoint]) -> None:
        self.values, self.powers = np.array([(p.value, p.power_W) for p in front]).T
        self.best = np.array([self.powers.min(), self.values.max()])
        self.ranges = np.array([np.ptp(self.powers), -np.ptp(self.values)])

    def __call__(self, values: Array, powers: Array) -> Array:
        """Return (P, 2) from criterion (P,) and power (P,)."""
        return np.asarray((np.column_stack([powers, values]) - self.best) / self.ranges)

    def undo(self, F: Array) -> tuple[Array, Array]:
        """Return criterion (P,) and power (P,) of (P, 2)."""
        powers, values = (self.best + self.ranges * F).T
        return values, powers


class PowerAndCompeting:
    """The compiled objective with a criterion next to the power; see ``metaheuristics.multi_objective.ManyObjectives``."""

    def __init__(self, objective: CompiledObjective, criterion: CompetingObjective, scale: Scale) -> None:
        self.names, self.lower, self.upper, self.count = objective.names, objective.lower, objective.upper, 2
        self._objective, self._criterion, self._scale = objective, criterion, scale

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return objectives (P, 2) and violations (P,)."""
        power, violation = self._objective(X)
        return self._scale(self._criterion.evaluate_many(self._objective, X), power), violation


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchFront:
    """Feasible nondominated points of one run after a budget."""

    solver: str  #: name of the search
    budget: int  #: evaluations allowed
    values: Array  #: (k,) criterion
    powers: Array  #: (k,) [W]
    X: Array  #: (k, n)


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


@dataclass(frozen=True, kw_only=True)
class Challenge:
    """The best points of all searches, compared with the least power at their own criterion."""

    points: int  #: number of nondominated points
    solved: int  #: for how many of these, the lowest, the least power was solved for
    infeasible: int  #: how many of these the exact functions find infeasible
    least_gap: (
        float  #: smallest power above the least one at an equal criterion, relative; negative if a point is better
    )
    moved: int  #: number of points at which the front itself was improved by more than a millionth
    front: tuple[FrontPoint, ...]  #: the front with all solved points


class FoundFront(NamedTuple):
    """The true front with its knees, and what the searches found."""

    front: tuple[FrontPoint, ...]  #: with the points that were solved to answer the searches
    knees: tuple[Knee, ...]  #: of the front
    searches: tuple[SearchFront, ...] = ()  #: fronts of all runs
    qualities: tuple[Quality, ...] = ()  #: a row for each search and budget
    challenge: Challenge | None = None  #: None without searches


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
        known = list(find_reference(identify_problem(self.problem)).x)
        effort = {"points": self.points, "starts": self.starts, "seed": self.seed}
        inputs = {**fingerprint(problem), "criterion": criterion.name, **effort, "known": known}
        solver, code = work.solver(), [front_module]

        def solve() -> list[dict[str, object]]:
            options: dict[str, Any] = {**effort, "solver": solver, "progress": work.progress, "known": known}
            return [asdict(p) for p in solve_front(problem, criterion, **options)]

        stored = work.store.compute(f"front-{criterion.name}-{{key}}", inputs, solve, code=code)
        front = tuple(decode(FrontPoint, point) for point in stored)
        if not self.searches:
            yield FoundFront(front, find_knees(front))
            return
        searches = self._run_searches(problem, Scale(front), work)
        inputs = {**inputs, "searches": {name: list(b) for name, b in self.searches.items()}, "runs": self.runs}
        challenge = partial(challenge_front, problem, criterion, front, searches, solver, work.progress)
        outcome = work.compute(Challenge, f"challenge-{criterion.name}-{{key}}", inputs, challenge, code=code)
        qualities = tuple(compute_qualities(outcome.front, searches))
        yield FoundFront(outcome.front, find_knees(outcome.front), tuple(searches), qualities, outcome)

    def _run_searches(self, problem: GaitProblem, scale: Scale, work: Work) -> list[SearchFront]:
        """Return the fronts of all runs on a problem without the criterion's demand; each finished run is stored.

        The scale keeps either objective from dominating an algorithm's distances.
        """
        objectives = PowerAndCompeting(compile_objective(problem), self.criterion, scale)
        ranges = [*scale.best.tolist(), *scale.ranges.tolist()]
        identity = {**fingerprint(problem), "criterion": self.criterion.name, "scale": ranges}
        fronts = []
        for name, budgets in self.searches.items():
            algorithm = make_front_algorithm(name)
            for run in range(self.runs):
                seed = self.seed + run
                inputs = {**identity, "budgets": list(budgets), "algorithm": repr(algorithm), "seed": seed}
                compute = partial(_run_search, objectives, algorithm, budgets, seed)
                snapshots = work.store.compute(f"{name.lower()}-{run}-{{key}}", inputs, compute)
                for budget, snapshot in zip(budgets, snapshots, strict=True):
                    values, powers = scale.undo(np.array(snapshot["F"]).reshape(-1, 2))
                    X = np.array(snapshot["X"]).reshape(-1, len(problem.names))
                    fronts.append(SearchFront(solver=name, budget=budget, values=values, powers=powers, X=X))
                work.progress(f"{name}, run {run}")
        return fronts

    def report(self, findings: FoundFront) -> Answer:
        problem, criterion, challenge = self.problem, self.criterion, findings.challenge
        stem = f"{problem.name}-front-{criterion.name}"
        caption = "The front as a line, its knees, and what the searches found; its cheap part on the right."
        rows = [
            {
                f"{criterion.name}_{criterion.unit.replace('/', '_')}": point.value,
                "power_W": point.power_W,
                "price": point.price,
                "violation": point.violation,
                **problem.by_name(np.array(point.x)),
            }
            for point in findings.front
        ]
        return Answer(
            stem=f"{problem.name}-pareto-{criterion.name}",
            title=f"{problem.name}: power against {criterion.name}",
            parts=(
                *_make_tables(findings, criterion),
                *_report_searches(findings, criterion),
                Figure(name=stem, caption=caption, drawing=plot_front(findings, criterion, problem)),
                make_record_table(stem, rows),
            ),
            data={
                **describe_problem(criterion.drop_demand(problem)),
                "criterion": {"name": criterion.name, "unit": criterion.unit},
                "front": [asdict(point) for point in findings.front],
                "knees": [asdict(knee) for knee in findings.knees],
                "searches": [asdict(row) for row in findings.qualities],
                "challenge": challenge and {key: v for key, v in asdict(challenge).items() if key != "front"},
            },
        )


def _run_search(
    objectives: PowerAndCompeting, algorithm: MultiObjective, budgets: Sequence[int], seed: int
) -> list[dict[str, Any]]:
    snapshots = minimize_many(objectives, algorithm, evaluations=budgets, seed=seed)
    return [{"F": s.F.tolist(), "X": s.X.tolist()} for s in snapshots]


def parse_searches(texts: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return the budgets by algorithm from ``NSGA2=10000,100000``; none from ``none``; raises InputError for another text."""
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


def compute_qualities(front: Sequence[FrontPoint], fronts: Sequence[SearchFront]) -> list[Quality]:
    """Return a row for each search and budget."""
    from pymoo.indicators.hv import HV
    from pymoo.indicators.igd import IGD

    scale = Scale(front)
    true = scale(scale.values, scale.powers)
    hypervolume, distance = HV(ref_point=np.full(2, REFERENCE)), IGD(true)
    whole = float(hypervolume(true))
    rows = []
    for solver, budget in dict.fromkeys((f.solver, f.budget) for f in fronts):
        runs = [f for f in fronts if (f.solver, f.budget) == (solver, budget)]
        found = [f for f in runs if len(f.values)]
        scaled = [scale(f.values, f.powers) for f in found]
        shares = [float(hypervolume(F)) / whole for F in scaled] + [0.0] * (len(runs) - len(found))
        above = [float(np.mean(f.powers / np.interp(f.values, scale.values, scale.powers) - 1.0)) for f in found]
        rows.append(
            Quality(
                solver=solver,
                budget=budget,
                runs=len(runs),
                empty=len(runs) - len(found),
                hypervolume=_compute_spread(shares),
                igd=_compute_spread([float(distance(F)) for F in scaled]) if found else None,
                gap=_compute_spread(above) if found else None,
            )
        )
    return rows


def _compute_spread(numbers: Sequence[float]) -> Spread:
    return float(np.min(numbers)), float(np.median(numbers)), float(np.max(numbers))


def challenge_front(
    problem: GaitProblem,
    criterion: CompetingObjective,
    front: Sequence[FrontPoint],
    fronts: Sequence[SearchFront],
    solver: Solver,
    progress: Progress,
) -> Challenge:
    """Find the least power at the criterion of each nondominated point of all runs.

    It is solved for from the point itself and from the nearest one of the front. If no point betters the true front here,
    none does. Of more than a thousand points those are taken that are lowest above the straight lines between the front's
    points.
    """
    points = select_front(
        FrontPoint(value=v, power_W=w, violation=0.0, x=tuple(x))
        for found in fronts
        for v, w, x in zip(found.values.tolist(), found.powers.tolist(), found.X.tolist(), strict=True)
    )
    values, powers = np.array([(p.value, p.power_W) for p in front]).T
    lowest = sorted(points, key=lambda p: p.power_W / float(np.interp(p.value, values, powers)))[:MOST_CHALLENGES]
    solved: list[FrontPoint] = []
    gaps: list[float] = []
    infeasible = moved = 0
    for point in lowest:
        exact = build_exact_model(problem).at(point.x, problem.p)
        if not exact.violation <= FEASIBILITY_TOLERANCE:
            infeasible += 1
            continue
        near = front[int(np.argmin(np.abs(values - point.value)))]
        at = min(point.value, front[-1].value)
        of_front, of_search = (solve_point(problem, criterion, at, np.array(p.x), solver) for p in (near, point))
        candidates = [p for p in (of_front, of_search) if p is not None]
        if not candidates:
            gaps.append(exact.cost / near.power_W - 1.0 if near.value >= point.value else -np.inf)
            continue
        best = min(candidates, key=lambda p: p.power_W)
        moved += of_front is None or best.power_W < of_front.power_W * (1.0 - 1e-6)
        solved.append(best)
        gaps.append(exact.cost / best.power_W - 1.0)
        progress(f"{criterion.name} {point.value:.5g} {criterion.unit}")
    return Challenge(
        points=len(points),
        solved=len(solved),
        infeasible=infeasible,
        least_gap=min(gaps, default=np.inf),
        moved=moved,
        front=tuple(select_front([*front, *solved])),
    )


def _make_tables(findings: FoundFront, criterion: CompetingObjective) -> tuple[Part, ...]:
    """Some points of the front, and its knees."""
    front, unit, per = findings.front, criterion.unit, f"W per {criterion.unit}"
    shown = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    return (
        make_table(
            f"Front of power against {criterion.name}, {len(front)} points, {len(shown)} shown",
            shown,
            {
                criterion.name: lambda p: f"{p.value:z.5f} {unit}",
                "power": lambda p: f"{p.power_W:.5f} W",
                "price": lambda p: f"{p.price:.4g} {per}",
            },
        ),
        make_table(
            "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1",
            findings.knees,
            {
                criterion.name: lambda k: f"{k.value:z.5f} {unit}",
                "power": lambda k: f"{k.power_W:.5f} W",
                "turn": lambda k: f"{k.turn_deg:z.0f} degrees",
                "price before": lambda k: f"{k.price_before:.4g} {per}",
                "price after": lambda k: f"{k.price_after:.4g} {per}",
            },
        ),
    )


def _report_searches(findings: FoundFront, criterion: CompetingObjective) -> tuple[Part, ...]:
    challenge = findings.challenge
    if challenge is None:
        return ()
    return (
        make_table(
            "Searches: median over runs (least to greatest)",
            findings.qualities,
            {
                "solver": lambda q: q.solver,
                "evaluations": lambda q: f"{q.budget:,}",
                "hypervolume, of the front's": lambda q: _format_spread(q.hypervolume, 100, " %"),
                "IGD": lambda q: _format_spread(q.igd, 1, ""),
                "mean power above the front": lambda q: _format_spread(q.gap, 100, " %"),
            },
        ),
        f"{challenge.points} points of the searches are nondominated; the least power was solved for {challenge.solved} of "
        f"these, the lowest. The nearest is {100 * challenge.least_gap:+z.4f} % above the least power at its "
        f"{criterion.name}; {challenge.moved} of them moved the front, {challenge.infeasible} are infeasible for the exact "
        "functions",
    )


def _format_spread(values: Spread | None, factor: float, unit: str) -> str:
    if values is None:
        return "-"
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"


def plot_front(findings: FoundFront, criterion: CompetingObjective, problem: GaitProblem) -> Drawing:
    """Plot the front with its knees and the points of the searches (left), and its lower part (right)."""
    values, powers = np.array([(p.value, p.power_W) for p in findings.front]).T
    knees, demand = findings.knees, criterion.get_demand(problem)
    end = knees[0].value + 0.08 * np.ptp(values) if knees else values[0] + 0.5 * np.ptp(values)
    top = float(np.interp(end, values, powers))
    with use_style():
        figure = make_figure(7.2, 3.3)
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            _plot_searches(axes, findings.searches)
            axes.plot(values, powers, "-", color=COLOURS["ipopt"], label=f"IPOPT, {len(values)} points")
            if knees:
                ring = {"markeredgecolor": COLOURS["aco"], "markersize": 9, "markeredgewidth": 1.6}
                axes.plot(
                    *zip(*[(k.value, k.power_W) for k in knees], strict=True), "o", color="none", label="knee", **ring
                )
            if values[0] < demand < values[-1]:
                label = "demanded in the paper's problem"
                axes.axvline(demand, color="0.6", linestyle=":", linewidth=1.0, label=label)
            axes.set_xlabel(make_axis_label(criterion.name, criterion.unit))
            axes.locator_params(axis="x", nbins=6)
        left.set_ylabel("power [W]")
        left.set_xlim(values[0] - 0.03 * np.ptp(values), values[-1] + 0.03 * np.ptp(values))
        left.set_ylim(0.0, powers[-1] * 1.06)
        right.set_xlim(values[0] - 0.03 * (end - values[0]), end)
        right.set_ylim(powers[0] - 0.08 * (top - powers[0]), top)
        right.set_title("the front's cheap part", loc="left")
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        figure.set_figheight(3.3 + 0.19 * -(-len(labels) // 2))
    return figure


def _plot_searches(axes: Axes, searches: Sequence[SearchFront]) -> None:
    budgets = sorted({f.budget for f in searches})
    for solver, budget in sorted({(f.solver, f.budget) for f in searches}):
        runs = [f for f in searches if (f.solver, f.budget) == (solver, budget)]
        title, colour = SEARCHES[solver]
        axes.plot(
            np.concatenate([f.values for f in runs]),
            np.concatenate([f.powers for f in runs]),
            MARKS[budgets.index(budget) % len(MARKS)],
            color=colour,
            markersize=2.5,
            markeredgewidth=0.5,
            alpha=0.45,
            label=f"{title}, {budget:,} evaluations, {len(runs)} runs",
            rasterized=True,
        )
