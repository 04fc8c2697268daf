"""GaitBench's rules, its shipped baseline, the ranking of solvers by expected running time and solved targets, and its page.

``python -m benchmarks.gaitbench.baseline`` writes the baseline from full records.
"""

import csv
import lzma
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from compare.analysis.comparison import (
    Comparison,
    compare_problems,
    count_wins,
    explain_marks,
    index_solvers,
    tabulate_problems,
)
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS
from compare.analysis.units import is_zero
from compare.drawing.charts import make_ecdf_charts
from compare.report.document import Document, Section, Table, make_text_table
from compare.report.provenance import TERMS
from compare.report.study_sections import make_chart_figure
from compare.study.record import History, RunRecord, Times
from compare.study.run import EVALUATIONS, GRADIENT_SOLVERS, Inputs, ProblemSpec, Run, plan_runs
from nlp_gait import gaitbench
from nlp_gait.errors import InputError, format_value
from nlp_gait.gaitbench.facts import Subset
from nlp_gait.gaitbench.generated import is_generated, make_id

# Rules: the same runs, budget and seeds for all solvers.
RUNS = 15
BASELINE = tuple("random pso ga aco aco-grid cma de pymoo:GA pymoo:DE pymoo:ISRES slsqp ipopt".split())
DRAWN_RUNS = 3  # on each drawn instance
TABLE = Path(__file__).with_name("baseline.csv.xz")
BELOW = 1.0 - 1e-8  # of a target's gap: that of the run when it was reached, so that no rounding leaves it above
SEEDS = re.compile(r"([0-9]{1,12}):([0-9]{1,12})")
MOST_SEEDS = 1000


def choose_instances(
    suite: Subset | Literal["drawn"], instances: str | None = None, families: str | None = None, seeds: str = "0:5"
) -> tuple[str, ...]:
    """Return the ids of instances: of a suite, or those of a list, or those that families draw by seeds; both as texts.

    Raises as ``parse_seeds``, and UnknownNameError if there is no such instance or family.
    """
    chosen = () if instances is None else tuple(name.strip() for name in instances.split(","))
    if families is not None:
        drawn = parse_seeds(seeds)
        chosen += tuple(make_id(family.strip(), seed) for family in families.split(",") for seed in drawn)
    chosen = chosen or (list_baselines(drawn=True) if suite == "drawn" else gaitbench.list_instances(suite))
    for id in chosen:
        gaitbench.load(id)  # raises for unknown ids
    return chosen


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of ``0:15``, of which 15 is not one; raises InputError."""
    match = SEEDS.fullmatch(text)
    seeds = range(int(match[1]), int(match[2])) if match else range(0)
    if not 0 < len(seeds) <= MOST_SEEDS:
        raise InputError(f"--seeds takes FIRST:END, at most {MOST_SEEDS} seeds, got {format_value(text)}")
    return tuple(seeds)


def plan_bench_runs(
    instances: Sequence[str], solvers: Mapping[str, str], *, runs: int = RUNS, evaluations: int = EVALUATIONS
) -> tuple[Run, ...]:
    """Return the runs of some solvers, each with its label or an empty text, on some instances; run k has the seed k."""
    problems, labelled = [ProblemSpec(name=id) for id in instances], [(label, name) for name, label in solvers.items()]
    return plan_runs(problems, labelled, runs=runs, starts=runs, evaluations=evaluations)


class BaselineRun(NamedTuple):
    """One run of the baseline."""

    instance: str
    solver: str
    run: int  #: also the seed
    objective: float  #: in the problem's sense; NaN if no feasible point was found
    in_history: bool  #: whether the history ends at it; IPOPT without convergence has reached no target
    evaluations: int  #: equivalent ones of the whole run
    times: tuple[int, ...]  #: evaluations until each of ``ECDF_TARGETS``, as far as they were reached


@cache
def load_table(path: Path = TABLE) -> Mapping[str, tuple[BaselineRun, ...]]:
    """Return the rows of each instance."""
    rows: dict[str, list[BaselineRun]] = {}
    with lzma.open(path, "rt", encoding="utf-8", newline="") as file:
        for instance, solver, run, objective, in_history, evaluations, times in csv.reader(file):
            costs = int(evaluations), tuple(map(int, times.split()))
            row = BaselineRun(instance, solver, int(run), float(objective), in_history == "1", *costs)
            rows.setdefault(instance, []).append(row)
    return {instance: tuple(group) for instance, group in rows.items()}


def list_baselines(*, drawn: bool = False) -> tuple[str, ...]:
    """Return the ids of the instances with a baseline: drawn ones, or all others."""
    return tuple(id for id in load_table() if is_generated(id) is drawn)


@cache
def get_reference(instance: str) -> float:
    """Return the objective from which the table's gaps are: the best known one; of a drawn instance, the best of its rows."""
    loaded = gaitbench.load(instance)
    sign = loaded.gait_problem.objective.sign
    if not is_generated(instance):
        return sign * loaded.best_known
    return sign * min(sign * row.objective for row in load_table()[instance] if not math.isnan(row.objective))


@cache
def load_baseline(instance: str) -> tuple[RunRecord, ...]:
    """Return the runs of the baseline on an instance; raises InputError if none are shipped.

    A record has what rankings read: its final objective without its point, and the best so far where a target was reached.
    """
    if instance not in load_table():
        raise InputError(f"no baseline of {instance!r} is shipped; available: {', '.join(load_table())}")
    return tuple(map(make_record, load_table()[instance]))


def make_record(row: BaselineRun) -> RunRecord:
    """Return the record of a run of the baseline."""
    problem = gaitbench.load(row.instance).gait_problem
    inputs = Inputs(
        problem={"name": "gaitbench", "options": {"instance": row.instance}, "parameters": {}},
        objective=problem.objective,
        solver=row.solver,
        seed=row.run,
        handling="" if row.solver in GRADIENT_SOLVERS else "deb",
    )
    reference = get_reference(row.instance)
    unit = problem.objective.sign * (1.0 if is_zero(reference) else abs(reference))
    gaps = {time: target * BELOW for time, target in zip(row.times, ECDF_TARGETS, strict=False)}
    values: dict[int, float | None] = {time: reference + unit * gap for time, gap in gaps.items()}
    feasible = not math.isnan(row.objective)
    values[row.evaluations] = row.objective if row.in_history else None
    times = sorted(values)
    return RunRecord(
        problem=row.instance,
        solver=row.solver,
        run=row.run,
        inputs=inputs,
        reported_feasible=row.in_history,
        x=dict.fromkeys(problem.names, math.nan),
        objective=row.objective,
        violation=0.0 if feasible else math.nan,
        feasible=feasible,
        counts={"f": row.evaluations},
        history=History(evaluations=tuple(times), objective=tuple(values[time] for time in times)),
        time_s=Times(history=(math.nan,) * len(times)),
    )


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
