"""Ranks over problems, Friedman's test and the critical difference as computed by hand; wins, and the stars of the best."""

from dataclasses import replace

import pytest

from compare.analysis.comparison import Comparison, compare_problems, count_wins, list_user_solvers, rank_over_problems
from compare.analysis.headline import write_overall_headline
from compare.report.document import Table
from compare.report.study_sections import make_overview
from tests.compare.records import record

MEDIANS = {"walk": (1.0, 2.0, 3.0), "run": (1.0, 3.0, 2.0), "climb": (1.0, 2.0, 2.0)}
SOLVERS = ("ipopt", "mine", "pso")


@pytest.fixture(scope="module")
def comparisons() -> list[Comparison]:
    records = []
    for problem, values in MEDIANS.items():
        for solver, value in zip(SOLVERS, values, strict=True):
            for run in range(8):
                made = record(solver, run, [(10, value + 1e-3 * run)])
                inputs = replace(made.inputs, code="0" * 64 if solver == "mine" else "")
                records.append(replace(made, problem=problem, inputs=inputs))
    return compare_problems(records)


def test_ranks_and_tests_are_those_computed_by_hand(comparisons: list[Comparison]) -> None:
    from scipy.stats import friedmanchisquare  # costs a second to import

    ranking = rank_over_problems(comparisons)
    assert ranking.mean_ranks == pytest.approx({"ipopt": 1.0, "mine": 7.5 / 3, "pso": 7.5 / 3})
    assert ranking.friedman == pytest.approx(friedmanchisquare(*zip(*MEDIANS.values(), strict=True)).pvalue)
    # Demsar (2006), table 5: q = 2.343 for three solvers.
    assert ranking.critical_difference == pytest.approx(2.343 * (3 * 4 / (6 * 3)) ** 0.5, abs=1e-3)


def test_two_solvers_have_ranks_without_tests(comparisons: list[Comparison]) -> None:
    two = [r for c in comparisons for r in c.records if r.solver != "pso"]
    ranking = rank_over_problems(compare_problems(two))
    assert ranking.mean_ranks == {"ipopt": 1.0, "mine": 2.0}
    assert ranking.friedman is None and ranking.critical_difference is None


def test_wins_ties_and_losses_of_the_users_solver(comparisons: list[Comparison]) -> None:
    assert list_user_solvers(comparisons) == ["mine"]
    found = {r.other: (r.wins, r.ties, r.losses) for r in count_wins(comparisons, "mine")}
    assert found == {"ipopt": (0, 0, 3), "pso": (1, 1, 1)}


def test_the_matrix_marks_the_users_solver_and_the_headline_begins_with_the_users_solver(
    comparisons: list[Comparison],
) -> None:
    assert write_overall_headline(comparisons).startswith("mine wins, ties and loses on problems: ")
    matrix = next(part for part in make_overview(comparisons).parts if isinstance(part, Table))
    assert list(matrix.columns) == ["problem", "IPOPT", "mine", "PSO"]
    rows = {str(row[0]): row[1:] for row in matrix.rows}
    assert [str(cell)[-1] for cell in rows["walk"]] == ["-", "%", "+"]  # worse than IPOPT, better than PSO
    assert rows["wins/ties/losses"] == ("0/0/3", "-", "1/1/1")
    assert rows["mean rank"] == ("1.00", "2.50", "2.50")
