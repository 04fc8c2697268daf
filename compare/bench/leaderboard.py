"""The leaderboard: ranking of the solvers on the suite, by expected running time and by solved targets, and its page."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.comparison import Comparison, compare_problems, index_solvers
from compare.analysis.overview import count_wins, explain_marks, tabulate_problems
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS
from compare.bench.baseline import get_reference, load_baseline
from compare.drawing.charts import make_ecdf_charts
from compare.report.document import Document, Section, Table, make_text_table
from compare.report.provenance import TERMS
from compare.report.study_sections import make_chart_figure
from compare.study.record import RunRecord
from compare.study.run import EVALUATIONS

HOW = (
    "Every solver makes {runs} runs on each instance, with {evaluations} evaluations each, run k with the seed k; IPOPT and "
    "SLSQP begin at a random point and end by themselves, SLSQP within the same budget and both within 60 s. What counts is what "
    "the exact functions give. The mean rank is that of the expected running time over all instances and the targets {targets} "
    "above the best known; equals share a rank, and pairs that no solver reached are left out."
)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A solver's place on the suite."""

    solver: str
    #: Of its expected running time, over all pairs of instance and target (``TARGETS``) that a solver reached; equals share a
    #: rank
    mean_rank: float
    #: Share of all triples of instance, run and target (31, from 100 % to 1e-4 % above the best known) that it solved
    solved: float
    solved_rank: int  #: place by that share
    feasible: float  #: share of its runs that end feasible
    reached: tuple[int, ...]  #: number of instances on which it reached a target at least once, by target


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaderboard:
    """All solvers on some instances."""

    comparisons: tuple[Comparison, ...]  #: one for each instance, with gaps from the best known objective
    standings: tuple[Standing, ...]  #: best mean rank first

    def place(self, solver: str) -> int:
        """Return the place of a solver, from 1."""
        return [standing.solver for standing in self.standings].index(solver) + 1


def rank_solvers(instances: Sequence[str], records: Sequence[RunRecord] = (), *, shipped: bool = True) -> Leaderboard:
    """Rank the solvers of records, and of the baseline if ``shipped``; raises InputError for an instance without baseline."""
    baseline = [record for id in instances for record in load_baseline(id)] if shipped else []
    everything = [*baseline, *(record for id in instances for record in records if record.problem == id)]
    references = {id: get_reference(id) for id in instances} if shipped else {}
    comparisons = tuple(compare_problems(everything, references=references))
    return Leaderboard(comparisons=comparisons, standings=tuple(_make_standings(comparisons)))


def _make_standings(comparisons: Sequence[Comparison]) -> list[Standing]:
    from scipy.stats import rankdata

    indexes, names = index_solvers(comparisons)
    costs = np.array([[[on[name].expected_cost(t) for name in names] for t in TARGETS] for on in indexes])
    rows = costs.reshape(-1, len(names))
    rows = rows[np.isfinite(rows).any(axis=1)]
    equal = (len(names) + 1) / 2  # where no solver reaches a target
    ranks = rankdata(rows, axis=1).mean(axis=0) if len(rows) else np.full(len(names), equal)
    curves = [[curve for on in indexes for curve in on[name].curves] for name in names]
    hits = [[math.isfinite(c.cost_to_reach(t)) for c in of_solver for t in ECDF_TARGETS] for of_solver in curves]
    solved = [float(np.mean(of_solver)) for of_solver in hits]
    places = rankdata([-share for share in solved], method="min")
    standings = [
        Standing(
            solver=name,
            mean_rank=float(ranks[k]),
            solved=solved[k],
            solved_rank=int(places[k]),
            feasible=float(np.mean([math.isfinite(cost) for on in indexes for cost in on[name].costs])),
            reached=tuple(int(np.isfinite(costs[:, t, k]).sum()) for t in range(len(TARGETS))),
        )
        for k, name in enumerate(names)
    ]
    return sorted(standings, key=lambda standing: (standing.mean_rank, standing.solved_rank))


def make_leaderboard_page(
    board: Leaderboard, solver: str | None, suite: str, evaluations: int = EVALUATIONS
) -> Document:
    """Return the page of a leaderboard on a suite, or on that of a solver if it is not None."""
    count_of = len(board.comparisons)
    runs = sorted({len(solver.records) for comparison in board.comparisons for solver in comparison.solvers})
    targets = ", ".join(f"{100 * target:g} %" for target in TARGETS)
    subject, (header, *rows) = tabulate_problems(board.comparisons, solver)
    title = f"GaitBench, {suite}: {count_of} instances, {len(board.standings)} solvers"
    return Document(
        title=title if solver is None else f"{solver} on {title}",
        headline=() if solver is None else describe_place(board, solver),
        parts=(
            _make_standings_table(board),
            make_chart_figure(
                "gaitbench-runtime",
                "Share of all triples of instance, run and target solved within a number of evaluations per variable; "
                "31 targets, from 100 % to 1e-4 % above the best known.",
                make_ecdf_charts(board.comparisons, per_variable=True),
            ),
            Section(title="Instance by instance", parts=(explain_marks(subject), make_text_table(header, rows))),
            Section(
                title="How it was measured",
                parts=(HOW.format(runs=" or ".join(map(str, runs)), evaluations=evaluations, targets=targets), TERMS),
            ),
        ),
    )


def describe_place(board: Leaderboard, solver: str) -> tuple[str, ...]:
    """Return the result of a solver in sentences."""
    place = board.place(solver)
    standing = board.standings[place - 1]
    scores = count_wins(board.comparisons, solver)
    won = sum(score.wins > score.losses for score in scores)
    lost = sum(score.losses > score.wins for score in scores)
    return (
        f"{solver} takes place {place} of {len(board.standings)} by expected running time (mean rank "
        f"{standing.mean_rank:.2f}) and place {standing.solved_rank} by solved targets ({100 * standing.solved:.1f} %).",
        f"{100 * standing.feasible:.0f} % of its runs end feasible.",
        f"It is better than {won} of the other {len(scores)} solvers on more instances than it is worse, and worse than {lost} "
        "(rank-sum tests at 5 %, Holm-corrected).",
    )


def _make_standings_table(board: Leaderboard) -> Table:
    rows = [
        (
            *(str(place), s.solver, f"{s.mean_rank:.2f}", str(s.solved_rank)),
            *(f"{100 * s.solved:.1f} %", f"{100 * s.feasible:.0f} %"),
            *(f"{reached}/{len(board.comparisons)}" for reached in s.reached),
        )
        for place, s in enumerate(board.standings, start=1)
    ]
    targets = (f"to {100 * t:g} %" for t in TARGETS)
    header = ("place", "solver", "mean rank", "by solved", "solved", "feasible", *targets)
    return make_text_table(
        header, rows, "Mean rank of the expected running time; instances of which each target was reached"
    )
