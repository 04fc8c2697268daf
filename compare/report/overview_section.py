"""The section that begins a report on many problems: the matrix of problems and solvers, ranks, wins of the user's solvers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from compare.analysis.comparison import Comparison
from compare.analysis.overview import count_wins, describe_tests, list_user_solvers, rank_over_problems
from compare.analysis.verdict import find_leaders
from compare.drawing.comparison_figures import list_expected_costs, plot_performance_profile
from compare.report.document import Figure, Part, Section, Table, text_table


def make_overview(comparisons: Sequence[Comparison]) -> Section:
    """Return the section on all problems of a study together."""
    parts: list[Part] = [
        "Median gap to the best known value over all runs. A star marks the best median and those that do not differ from it "
        "significantly (rank-sum test at 5 %, Holm-corrected over all pairs on the problem). Ranks are those of the medians, of "
        f"solvers that ran on all problems; equals share a rank. {describe_tests(rank_over_problems(comparisons))}".strip(),
        _make_matrix(comparisons),
        *(_make_wins(comparisons, solver) for solver in list_user_solvers(comparisons)),
    ]
    if list_expected_costs(comparisons):
        parts.append(
            Figure(
                name="performance-profile",
                caption="Share of problems and targets that a solver reaches within a factor of the cheapest one's expected "
                "evaluations.",
                drawing=plot_performance_profile(comparisons),
            )
        )
    return Section(title="All problems", parts=parts)


def _make_matrix(comparisons: Sequence[Comparison]) -> Table:
    ranks = rank_over_problems(comparisons).mean_ranks
    names = list(dict.fromkeys([*ranks, *(solver.name for c in comparisons for solver in c.solvers)]))
    rows = []
    for comparison in comparisons:
        leaders, medians = find_leaders(comparison), {s.name: s.median_cost for s in comparison.solvers}
        rows.append((comparison.problem, *(_format_cell(comparison, name, medians, leaders) for name in names)))
    rows.append(("mean rank", *(f"{ranks[name]:.2f}" if name in ranks else "-" for name in names)))
    return text_table(("problem", *names), rows, "Median gap of each solver on each problem")


def _format_cell(comparison: Comparison, name: str, medians: dict[str, float], leaders: set[str]) -> str:
    if name not in medians:
        return "-"
    gap = comparison.gap(medians[name])
    return f"{comparison.format_gap(gap)}{' *' if name in leaders else ''}" if math.isfinite(gap) else "infeasible"


def _make_wins(comparisons: Sequence[Comparison], solver: str) -> Table:
    rows = [(r.other, str(r.wins), str(r.ties), str(r.losses)) for r in count_wins(comparisons, solver)]
    caption = f"Problems on which {solver} is significantly better, not different, or worse"
    return text_table(("against", "wins", "ties", "losses"), rows, caption)
