"""A study in one call: ``nlp_gait.compare("nao-ssp", ["pso", MySearch()], runs=11)``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.analysis.columns import format_rows
from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.headline import write_headlines
from compare.analysis.units import name_solver
from compare.drawing.charts import make_final_gap_charts, plot_charts
from compare.drawing.figures import share_looks
from compare.report.latex import format_latex_overview, format_latex_table
from compare.report.study_report import write_report
from compare.study.record import RunRecord, make_frame
from compare.study.run import IPOPT, ProblemSpec, plan_runs
from compare.study.study import Study, StudyFile, run_study
from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation import GaitProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from metaheuristics.interface import Algorithm

    Solver = str | Algorithm | Callable[..., object]
    Problem = str | GaitProblem | ProblemSpec


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ComparedStudy:
    """A finished study; its text is its headlines."""

    records: Sequence[RunRecord]

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """All solvers on each problem, the best median first."""
        return compare_problems(self.records)

    def __repr__(self) -> str:
        return "\n".join(write_headlines(self.comparisons))

    def table(self, problem: str | None = None) -> str:
        """Return the table of solvers on a problem, by default on the first one, as text."""
        header, rows = format_rows(self._find(problem))
        widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
        return "\n".join("  ".join(map(str.rjust, row, widths)) for row in (header, *rows))

    def to_frame(self) -> Any:
        """Return the runs as a pandas frame, see ``make_frame``; raises MissingExtraError."""
        return make_frame(self.records)

    def plot(self, problem: str | None = None) -> Figure:
        """Plot the final gap of every run on a problem, by default on the first one."""
        with share_looks({name_solver(record.solver) for record in self.records}):
            return plot_charts(make_final_gap_charts(self._find(problem)))

    def latex(self) -> str:
        """Return a table of each problem, and of several problems and all solvers, see ``compare.report.latex``."""
        tables = [format_latex_table(comparison) for comparison in self.comparisons]
        return "\n".join([*tables, *([format_latex_overview(self.comparisons)] if len(tables) > 1 else [])])

    def report(self, folder: Path | str) -> Path:
        """Write the report to a folder and return its page; raises OutputError."""
        return write_report(Path(folder), self.records, StudyFile())[0]

    def _find(self, problem: str | None) -> Comparison:
        by_problem = {comparison.problem: comparison for comparison in self.comparisons}
        if problem is not None and problem not in by_problem:
            raise unknown("problem of this study", problem, by_problem)
        return self.comparisons[0] if problem is None else by_problem[problem]


def compare(
    problems: Problem | Sequence[Problem],
    solvers: Sequence[Solver] | Mapping[str, Solver] = ("pso", "ga", "aco"),
    *,
    runs: int = 11,
    starts: int = 20,
    evaluations: int = 10_000,
    seed: int = 0,
    jobs: int = 1,
    out: Path | str | None = None,
) -> ComparedStudy:
    """Run IPOPT and searches on problems, judge all points by the same exact functions, and return the study.

    Args:
        problems: names as in ``nlp-gait list``, problems, or specifications with options; one or several.
        solvers: names, search algorithms, or functions (see ``metaheuristics.to_algorithm``); a mapping gives them labels.
        runs: of each search.
        starts: of IPOPT and of other gradient methods; 0 for searches only.
        evaluations: budget of a run of a search.
        seed: of run 0; run k has ``seed + k``.
        jobs: processes; the solvers must be picklable for more than one, and the script importable.
        out: folder of the records, from which the same call continues; None keeps them in memory.

    Raises:
        InputError, UnknownNameError: there is nothing to run, or a solver or problem cannot run, see ``check_run``.
    """
    if runs < 1 or starts < 0:
        raise InputError(f"runs must be at least 1 and starts at least 0, got {runs} and {starts}")
    given = list(solvers.items()) if isinstance(solvers, Mapping) else [("", solver) for solver in solvers]
    if starts and all(solver != IPOPT for _, solver in given):
        given.insert(0, ("", IPOPT))
    listed = [problems] if isinstance(problems, (str, GaitProblem, ProblemSpec)) else problems
    specs = [problem if isinstance(problem, ProblemSpec) else ProblemSpec(name=problem) for problem in listed]
    planned = plan_runs(specs, given, runs=runs, starts=starts, evaluations=evaluations, seed=seed)
    study = Study(runs=planned, folder=None if out is None else Path(out), jobs=jobs)
    return ComparedStudy(records=run_study(study))
