"""Power against a balance margin or speed: the true front, its knees, and how near evolutionary searches come to it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import make_axis_label
from compare.drawing.figures import COLOURS, make_figure, use_style
from compare.questions.pareto import front as front_module
from compare.questions.pareto.competing import CompetingObjective, make_competing_objective
from compare.questions.pareto.front import Bends, FrontPoint, find_bends, solve_front
from compare.questions.pareto.searches import (
    Challenge,
    Quality,
    Scale,
    SearchFront,
    challenge_front,
    compute_qualities,
    run_searches,
    select_best,
)
from compare.questions.question import Answer, Question, Work, make_csv_table, make_table
from compare.report.document import Figure, Part, Table
from compare.study.references import find_reference
from compare.study.task import describe_problem
from metaheuristics.multi_objective import check_budgets, make_front_algorithm
from nlp_gait.backends.identity import fingerprint, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem

SEARCH_COLOURS = {
    "NSGA2": COLOURS["ga"],
    "CMOPSO": COLOURS["pso"],
}
SEARCH_NAMES = {"NSGA2": "NSGA-II", "CMOPSO": "CMOPSO"}
MARKS = ("x", "+", ".")


class FoundFront(NamedTuple):
    """The true front with its knees, and what the searches found."""

    front: tuple[FrontPoint, ...]  #: with the points that were solved to answer the searches
    bends: Bends  #: its knees
    searches: tuple[SearchFront, ...] = ()  #: fronts of all runs
    qualities: tuple[Quality, ...] = ()  #: a row for each search and budget
    challenge: Challenge | None = None  #: None without searches


@dataclass(frozen=True, kw_only=True, eq=False)
class ParetoFront(Question[FoundFront]):
    """How does the least power trade against one criterion, and how near do searches come?"""

    name: ClassVar[str] = "pareto"

    objective: str = "dbm_y_mean"  #: name of the criterion next to power
    points: int = 40  #: of the front
    starts: int = 5  #: random starts at some of its points
    #: budgets by algorithm; none for the front alone
    searches: Mapping[str, Sequence[int]] = field(default_factory=dict)
    runs: int = 11  #: of each algorithm
    seed: int = 0  #: of starts and of the first run

    def __post_init__(self) -> None:
        """Validate criterion and searches.

        Raises:
            UnknownNameError: an unknown criterion.
            InputError: the problem has nothing to trade.
            SearchError: an unknown algorithm, a budget that is not allowed, or pymoo is not installed.
        """
        make_competing_objective(self.objective, self.problem)
        for algorithm, budgets in self.searches.items():
            check_budgets(make_front_algorithm(algorithm), budgets)

    @cached_property
    def criterion(self) -> CompetingObjective:
        """The objective next to power."""
        return make_competing_objective(self.objective, self.problem)

    def find(self, work: Work) -> Iterator[FoundFront]:
        criterion, problem = self.criterion, self.criterion.drop_demand(self.problem)
        known = list(find_reference(identify_problem(self.problem)).x)
        effort = {"points": self.points, "starts": self.starts, "seed": self.seed}
        inputs = {**fingerprint(problem), "criterion": criterion.name, **effort, "known": known}
        solver, code = work.solver(), [front_module]

        def solve() -> list[dict[str, object]]:
            options = {"solver": solver, "progress": work.progress, "known": known}
            return [asdict(p) for p in solve_front(problem, criterion, **effort, **options)]  # type: ignore[arg-type]

        stored = work.store.compute(f"front-{criterion.name}-{{key}}", inputs, solve, code=code)
        front = tuple(decode(FrontPoint, point) for point in stored)
        if self.searches:
            options = {"searches": self.searches, "runs": self.runs, "seed": self.seed}
            searches = run_searches(problem, criterion, Scale(front), **options, work=work)  # type: ignore[arg-type]

            def challenge() -> Challenge:
                points = select_best((found.values, found.powers, found.X) for found in searches)
                return challenge_front(problem, criterion, front, points, solver, work.progress)

            inputs = {**inputs, "searches": {name: list(b) for name, b in self.searches.items()}, "runs": self.runs}
            outcome = work.compute(Challenge, f"challenge-{criterion.name}-{{key}}", inputs, challenge, code=code)
            qualities = tuple(compute_qualities(outcome.front, searches))
            yield FoundFront(outcome.front, find_bends(outcome.front), tuple(searches), qualities, outcome)
        else:
            yield FoundFront(front, find_bends(front))

    def report(self, findings: FoundFront) -> Answer:
        problem, criterion, challenge = self.problem, self.criterion, findings.challenge
        stem = f"{problem.name}-front-{criterion.name}"
        shown = "The front as a line, its knees, and what the searches found; its cheap part on the right."
        outcome = {} if challenge is None else asdict(challenge)
        return Answer(
            stem=f"{problem.name}-pareto-{criterion.name}",
            title=f"{problem.name}: power against {criterion.name}",
            parts=(
                *_make_tables(findings, criterion),
                *_report_searches(findings, criterion),
                Figure(name=stem, caption=shown, drawing=plot_front(findings, criterion, problem)),
                _make_csv(stem, findings, criterion, problem),
            ),
            data={
                **describe_problem(criterion.drop_demand(problem)),
                "criterion": {"name": criterion.name, "unit": criterion.unit},
                "front": [asdict(point) for point in findings.front],
                "knees": asdict(findings.bends),
                "searches": [asdict(row) for row in findings.qualities],
                "challenge": {key: value for key, value in outcome.items() if key != "front"} or None,
            },
        )


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


def _make_tables(findings: FoundFront, criterion: CompetingObjective) -> tuple[Table, Table]:
    """Some points of the front, and its knees."""
    front, unit, per = findings.front, criterion.unit, f"W per {criterion.unit}"
    picked = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    return (
        make_table(
            f"Front of power against {criterion.name}, {len(front)} points, {len(picked)} shown",
            picked,
            {
                criterion.name: lambda p: f"{p.value:z.5f} {unit}",
                "power": lambda p: f"{p.power_W:.5f} W",
                "price": lambda p: f"{p.price:.4g} {per}",
            },
        ),
        make_table(
            "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1",
            findings.bends.knees,
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


def _format_spread(values: tuple[float, float, float] | None, factor: float, unit: str) -> str:
    if values is None:
        return "-"
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"


def _make_csv(stem: str, findings: FoundFront, criterion: CompetingObjective, problem: GaitProblem) -> Table:
    unit = criterion.unit.replace("/", "_")
    header = [f"{criterion.name}_{unit}", "power_W", f"price_W_per_{unit}", "violation", *problem.names]
    return make_csv_table(stem, header, [[p.value, p.power_W, p.price, p.violation, *p.x] for p in findings.front])


def plot_front(findings: FoundFront, criterion: CompetingObjective, problem: GaitProblem) -> Drawing:
    """Plot the front with its knees and the points of the searches (left), and its lower part (right)."""
    front, knees = findings.front, findings.bends.knees
    with use_style():
        figure = make_figure(7.2, 3.3)
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            _plot_points(axes, findings)
            axes.set_xlabel(make_axis_label(criterion.name, criterion.unit))
            axes.locator_params(axis="x", nbins=6)
        left.set_ylabel("power [W]")
        values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
        left.set_xlim(values[0] - 0.03 * np.ptp(values), values[-1] + 0.03 * np.ptp(values))
        left.set_ylim(0.0, powers[-1] * 1.06)
        end = knees[0].value + 0.08 * np.ptp(values) if knees else values[0] + 0.5 * np.ptp(values)
        top = float(np.interp(end, values, powers))
        right.set_xlim(values[0] - 0.03 * (end - values[0]), end)
        right.set_ylim(powers[0] - 0.08 * (top - powers[0]), top)
        right.set_title("the front's cheap part", loc="left")
        demand, label = criterion.get_demand(problem), "demanded in the paper's problem"
        if values[0] < demand < values[-1]:
            for axes in (left, right):
                axes.axvline(demand, color="0.6", linestyle=":", linewidth=1.0, label=label)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        figure.set_figheight(3.3 + 0.19 * -(-len(labels) // 2))
    return figure


def _plot_points(axes: Axes, findings: FoundFront) -> None:
    searches, knees = findings.searches, findings.bends.knees
    budgets = sorted({f.budget for f in searches})
    for solver, budget in sorted({(f.solver, f.budget) for f in searches}):
        chosen = [f for f in searches if (f.solver, f.budget) == (solver, budget)]
        values, powers = (np.concatenate([getattr(f, key) for f in chosen]) for key in ("values", "powers"))
        axes.plot(
            values,
            powers,
            MARKS[budgets.index(budget) % len(MARKS)],
            color=SEARCH_COLOURS[solver],
            markersize=2.5,
            markeredgewidth=0.5,
            alpha=0.45,
            label=f"{SEARCH_NAMES[solver]}, {budget:,} evaluations, {len(chosen)} runs",
            rasterized=True,
        )
    line = [(p.value, p.power_W) for p in findings.front]
    axes.plot(*zip(*line, strict=True), "-", color=COLOURS["ipopt"], label=f"IPOPT, {len(line)} points")
    if knees:
        axes.plot(
            [k.value for k in knees],
            [k.power_W for k in knees],
            "o",
            color="none",
            markeredgecolor=COLOURS["aco"],
            markersize=9,
            markeredgewidth=1.6,
            label="knee",
        )
