"""Sections on solvers over many problems: their median gaps and ranks."""

import math
from collections.abc import Mapping, Sequence

from compare.analysis.comparison import Comparison
from compare.analysis.overview import Ranking, count_wins, describe_tests, list_user_solvers
from compare.analysis.verdict import find_leaders
from compare.drawing.comparison_figures import list_expected_costs, plot_critical_difference, plot_performance_profile
from compare.report.document import Figure, Part, Section, Table, make_text_table


def make_overview(comparisons: Sequence[Comparison], ranking: Ranking) -> Section:
    """Return the section on all problems of a study together."""
    parts: list[Part] = [
        "Median gap to the best known value over all runs. A star marks the best median and those that do not differ from it "
        "significantly (rank-sum test at 5 %, Holm-corrected over all pairs on the problem). Ranks are those of the medians, of "
        f"solvers that ran on all problems; equals share a rank. {describe_tests(ranking)}".strip(),
        _make_matrix(comparisons, ranking.mean_ranks),
        *(make_wins_table(comparisons, solver) for solver in list_user_solvers(comparisons)),
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
    if ranking.critical_difference is not None:
        parts.append(
            Figure(
                name="critical-difference",
                caption=f"Mean ranks of the medians; a bar joins solvers that do not differ. {describe_tests(ranking)}",
                drawing=plot_critical_difference(ranking),
            )
        )
    return Section(title="All problems", parts=parts)


def _make_matrix(comparisons: Sequence[Comparison], ranks: Mapping[str, float]) -> Table:
    names = list(dict.fromkeys([*ranks, *(solver.name for c in comparisons for solver in c.solvers)]))
    rows = []
    for comparison in comparisons:
        leaders, medians = find_leaders(comparison), {s.name: s.median_cost for s in comparison.solvers}
        rows.append((comparison.problem, *(_format_cell(comparison, name, medians, leaders) for name in names)))
    rows.append(("mean rank", *(f"{ranks[name]:.2f}" if name in ranks else "-" for name in names)))
    return make_text_table(("problem", *names), rows, "Median gap of each solver on each problem")


def _format_cell(comparison: Comparison, name: str, medians: dict[str, float], leaders: set[str]) -> str:
    if name not in medians:
        return "-"
    gap = comparison.gap(medians[name])
    return f"{comparison.format_gap(gap)}{' *' if name in leaders else ''}" if math.isfinite(gap) else "infeasible"


def make_wins_table(comparisons: Sequence[Comparison], solver: str) -> Table:
    """Return on how many problems a solver is better or worse than each other one."""
    rows = [(r.other, str(r.wins), str(r.ties), str(r.losses)) for r in count_wins(comparisons, solver)]
    caption = (
        f"Problems on which {solver} is significantly better, not different, or worse (rank-sum test of the final objectives at "
        "5 %, Holm-corrected over all pairs on the problem)"
    )
    return make_text_table(("against", "wins", "ties", "losses"), rows, caption)
