"""The table of solvers: claims, verdicts of the judge, costs, failed runs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.record_statistics import TARGETS, bootstrap_interval
from compare.analysis.units import format_seconds, with_unit
from compare.study.record import RunRecord

HEADER = (
    "solver",
    "runs",
    "claimed",
    "feasible",
    "guaranteed",
    "best claimed",
    "best",
    "median",
    "worst",
    "median gap",
    "evaluations",
    "time per run",
)


@dataclass(frozen=True, kw_only=True)
class SolverSummary:
    """All runs of one solver on one problem; objectives in the problem's sense, None without a feasible run."""

    solver: str
    runs: int
    claimed: int | None  #: number whose solver claims a feasible result; None for imported results without claims
    feasible: int  #: number that the judge finds feasible at the problem's samples
    dense_feasible: int | None  #: number also feasible between the samples; None without a dense grid
    #: Number proven to satisfy all limits at all times; None where that was not requested or is impossible
    guaranteed: int | None
    best_claim: float | None  #: best objective that a run claims to be feasible
    #: Best objective that the judge finds feasible; likewise ``median`` and ``worst`` over the feasible runs
    best: float | None
    median: float | None
    worst: float | None
    median_interval: tuple[float, float] | None  #: 95 % bootstrap interval of the median
    gap: float | None  #: relative distance of the median from the best known objective
    evaluations: float  #: median equivalent evaluations of a run; NaN if those of a run are unknown
    time_s: float  #: median wall time of a run [s]; likewise
    build_s: float  #: longest time to build the symbolic problem [s]
    compile_s: float  #: longest time to compile the objective, or to make derivatives and solver [s]
    #: Expected running time to each of ``TARGETS``; infinite if it was never reached
    expected_evaluations: tuple[float, ...]
    expected_s: tuple[float, ...]  #: the same in seconds


def summarise(comparison: Comparison) -> list[SolverSummary]:
    """Return one summary per solver."""
    return [_summarise_solver(comparison, solver) for solver in comparison.solvers]


def _summarise_solver(comparison: Comparison, solver: SolverRuns) -> SolverSummary:
    costs, records, sign = solver.feasible, solver.records, comparison.objective.sign
    claims = [sign * r.claimed_objective for r in records if r.claimed and r.claimed_objective is not None]
    interval = sorted(sign * end for end in bootstrap_interval([costs], median)) if costs else None
    unsaid = all("imported" in r.definition and r.claimed_objective is None for r in records)
    proven = [g.satisfied for r in records if (g := r.verdict.guaranteed) is not None and not g.reason]
    dense = [r.verdict.dense_feasible for r in records]
    return SolverSummary(
        solver=solver.name,
        runs=len(records),
        claimed=None if unsaid else sum(r.claimed for r in records),
        feasible=len(costs),
        dense_feasible=None if all(found is None for found in dense) else sum(found is True for found in dense),
        guaranteed=sum(each is True for each in proven) if proven else None,
        best_claim=sign * min(claims) if claims else None,
        best=comparison.value(costs[0]) if costs else None,
        median=comparison.value(median(costs)) if costs else None,
        worst=comparison.value(costs[-1]) if costs else None,
        median_interval=(interval[0], interval[1]) if interval else None,
        gap=comparison.gap(median(costs)) if costs else None,
        evaluations=_apply_if_known(median, [c.total_cost() for c in solver.curves]),
        time_s=_apply_if_known(median, [r.time_s.solve for r in records]),
        build_s=_apply_if_known(max, [r.time_s.build for r in records]),
        compile_s=_apply_if_known(max, [r.time_s.compile for r in records]),
        expected_evaluations=tuple(solver.expected_cost(target) for target in TARGETS),
        expected_s=tuple(solver.expected_cost(target, "seconds") for target in TARGETS),
    )


def format_cells(summary: SolverSummary, comparison: Comparison) -> tuple[str, ...]:
    """Return one row of text under ``HEADER``."""
    values = (summary.best_claim, summary.best, summary.median, summary.worst)
    return (
        summary.solver,
        str(summary.runs),
        "-" if summary.claimed is None else f"{summary.claimed}/{summary.runs}",
        f"{summary.feasible}/{summary.runs}",
        "-" if summary.guaranteed is None else f"{summary.guaranteed}/{summary.runs}",
        *(with_unit(value, comparison.objective.unit) for value in values),
        comparison.format_gap(summary.gap),
        count(summary.evaluations),
        format_seconds(summary.time_s),
    )


def _apply_if_known(statistic: Callable[[list[float]], float], values: list[float]) -> float:
    return math.nan if any(math.isnan(value) for value in values) else statistic(values)


def count(number: float) -> str:
    """Format a number of evaluations; a dash if it is infinite or unknown."""
    return f"{number:,.0f}".replace(",", "\u202f") if math.isfinite(number) else "-"


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    found = []
    for solver in comparison.solvers:
        runs = [r.run for r in solver.records if not r.evaluations]
        if runs:
            which = f"run {runs[0]}" if len(runs) == 1 else f"runs {_join_numbers(runs)}"
            found.append(
                f"{solver.name}, {which} of {len(solver.records)}: the number of evaluations is unknown; all statistics of "
                f"evaluations exclude {solver.name}."
            )
    return found


def _join_numbers(numbers: Sequence[int]) -> str:
    """Return ascending numbers with their gaps: ``0 to 3, 7``."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(f"{part[0]}" if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)


@dataclass(frozen=True, kw_only=True)
class Failure:
    """Failed runs of one solver on one problem."""

    problem: str
    solver: str
    failed: int  #: number of runs without a point
    runs: int
    reason: str  #: status of the first

    @property
    def sentence(self) -> str:
        """The failures as one sentence."""
        return (
            f"{self.problem}, {self.solver}: {self.failed} of {self.runs} runs have no result; the first {self.reason}"
        )


def find_failures(records: Sequence[RunRecord]) -> list[Failure]:
    """Return the solvers with failed runs, in the order of their records."""
    found = []
    for problem, solver in dict.fromkeys((record.problem, record.solver) for record in records):
        own = [record for record in records if (record.problem, record.solver) == (problem, solver)]
        failed = [record for record in own if not record.x]
        if failed:
            found.append(
                Failure(problem=problem, solver=solver, failed=len(failed), runs=len(own), reason=failed[0].status)
            )
    return found
