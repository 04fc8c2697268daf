"""The answer of a study: gaps from shipped values, what is proven, what chance may be; ranks over problems by hand."""

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from casadi import MX

import nlp_gait
from compare.analysis.columns import format_rows
from compare.analysis.comparison import Comparison, compare_problems, count_wins, list_user_solvers, rank_over_problems
from compare.analysis.headline import write_headline, write_headlines, write_overall_headline
from compare.analysis.record_statistics import find_best_known
from compare.analysis.units import describe_value
from compare.report.document import Table
from compare.report.study_report import write_better_points
from compare.report.study_sections import make_overview
from compare.study.record import RunRecord
from compare.study.references import Reference, find_reference
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, run_study
from nlp_gait.backends.exact import identify_problem
from nlp_gait.formulation import Constraint
from nlp_gait.formulation.solution import load_result
from nlp_gait.proofs.branch_and_bound import certify
from nlp_gait.proofs.certificate import load_certificates, make_certificate_file
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import row, toy
from tests.compare.records import POWER, record, study

CERTIFIED = load_certificates()["walk12-lambda-0.4"].problem


@pytest.fixture(scope="module")
def runs() -> list[RunRecord]:
    """Two short runs of a search without IPOPT."""
    spec = ProblemSpec(name="walk12", options=CERTIFIED["options"], values=CERTIFIED["parameters"])
    tasks = [Run(problem=spec, solver="pso", evaluations=300, number=run) for run in range(2)]
    return run_study(Study(runs=tuple(tasks)))


def compare_with(known: Reference, runs: list[RunRecord]) -> Comparison:
    comparison = compare_problems(runs, references={} if known.objective is None else {"walk12": known.objective})[0]
    return replace(comparison, known=known)


def test_a_study_without_ipopt_is_measured_from_the_shipped_value(runs: list[RunRecord]) -> None:
    (comparison,) = compare_problems(runs)
    assert comparison.reference == find_reference(CERTIFIED).objective != find_best_known(runs)
    assert comparison.best is not None
    value = comparison.best.objective
    assert comparison.gap(-value) == pytest.approx((comparison.reference - value) / comparison.reference)
    known = f"the proven optimum {comparison.reference:.6f}"
    assert re.fullmatch(rf"PSO's median run ends [0-9.]+ % below {known}\..*", write_headline(comparison))


def test_a_better_run_is_announced_and_offered(runs: list[RunRecord], tmp_path: Path) -> None:
    comparison = compare_with(Reference(objective=0.5, source="shipped, best of 2 starts"), runs)
    shown = comparison.format_gap(-comparison.gap(comparison.solvers[0].costs[0]))
    assert f"found a new best value, {max(r.objective for r in runs):.6f}: {shown} better." in write_headline(
        comparison
    )
    assert comparison.gap(comparison.solvers[0].costs[0]) < 0.0
    (path,) = write_better_points(tmp_path, [comparison])
    written = load_result(path)
    assert comparison.best is not None and written.problem.by_name(written.x) == comparison.best.x
    assert json.loads(path.read_text())["best_known_before"]["objective"] == 0.5


def test_a_record_that_only_claims_to_be_better_is_not_offered(runs: list[RunRecord], tmp_path: Path) -> None:
    forged = [replace(r, objective=0.99) for r in runs]
    comparison = compare_with(Reference(objective=0.95), forged)
    assert comparison.better is not None and write_better_points(tmp_path, [comparison]) == []


def test_less_than_the_tolerance_is_no_gain(runs: list[RunRecord]) -> None:
    best = max(r.objective for r in runs)
    comparison = compare_with(Reference(objective=best * (1 - 5e-7)), runs)
    assert comparison.better is None and comparison.gap(-best) == 0.0


def test_a_single_value_is_compared_with_the_shipped_one() -> None:
    phase = nlp_gait.load("nao-ssp")
    known, objective = find_reference(identify_problem(phase)), phase.objective
    assert describe_value(known, 0.8543274, objective).endswith("this point is 1.0 % from it")
    assert "contribute" in describe_value(known, 0.84, objective)
    other = find_reference(identify_problem(phase.with_values(reach_margin=0.02)))
    assert describe_value(other, 0.84, objective) == "Best known value: none is shipped for these settings"


def test_the_headline_of_a_study_by_hand() -> None:
    """Medians over all runs: newton 10, swarm 10.55, colony 11.75 W; no pair differs significantly."""
    assert write_headline(compare_problems(study())[0]) == (
        "swarm's median run ends 5.5 % above the best value found (10.000000 W), colony's 18 % (order uncertain); 2 of 3 newton "
        "runs reach it."
    )


def make_runs(**values: Sequence[float | None]) -> list[RunRecord]:
    """Return runs that end at values; None for an infeasible one. IPOPT has no history."""
    return [
        record(solver, run, [(10, value)], feasible=value is not None)
        for solver, ends in values.items()
        for run, value in enumerate(ends)
    ]


def describe(runs: Sequence[RunRecord], known: Reference | None = None, sense: str = "minimise") -> str:
    """Return the headline of runs on one problem with a shipped value."""
    objective = replace(POWER, sense=sense)
    runs = [replace(r, inputs=replace(r.inputs, objective=objective)) for r in runs]
    reference = {} if known is None or known.objective is None else {"walk": known.objective}
    comparison = compare_problems(runs, references=reference)[0]
    return write_headline(comparison if known is None else replace(comparison, known=known))


PROVEN = Reference(objective=10.0, bound=10.0, source="shipped, proven to six digits")


def test_what_is_maximised_ends_below_the_optimum() -> None:
    assert describe(make_runs(pso=[9.0] * 3), PROVEN, "maximise").startswith(
        "PSO's median run ends 10 % below the proven"
    )


def test_the_users_solver_is_named_with_those_from_which_it_differs() -> None:
    values = {"mine": 10.02, "pso": 10.5, "ipopt": 10.0, "near": 10.021}
    records = []
    for solver, value in values.items():
        for run in range(12):
            made = record(solver, run, [(10, value + 2e-3 * run * (solver != "ipopt"))])
            records.append(replace(made, inputs=replace(made.inputs, code="0" * 64 if solver == "mine" else "")))
    assert write_headline(compare_problems(records)[0]) == (
        "mine's median run ends 0.31 % above the best value found (10.000000 W), near's 0.32 % (order uncertain), PSO's 5.1 %; "
        "all 12 IPOPT starts reach it. By rank-sum tests mine is better than PSO, worse than IPOPT and not "
        "distinguishable from near."
    )


def test_a_solver_without_feasible_runs_is_not_compared() -> None:
    """Three runs against three failures are not significant, which says nothing about the failed solver."""
    records = make_runs(mine=[10.5] * 3, ipopt=[10.0] * 20, broken=[None] * 3)
    records = [replace(r, inputs=replace(r.inputs, code="0" * 64 if r.solver == "mine" else "")) for r in records]
    assert "By rank-sum tests mine is worse than IPOPT." in write_headline(compare_problems(records)[0])


def test_many_problems_have_one_headline() -> None:
    many = [replace(r, problem=f"walk-{k}") for k in range(5) for r in study()]
    (headline,) = write_headlines(compare_problems(many))
    assert headline == (
        "Over 5 problems, the median of the median gaps is newton 0 %, swarm 5.5 % and colony 18 %. The best values found are "
        "reached by newton on 5."
    )
    failed = [replace(fail(r), problem=f"walk-{k}") for k in range(5) for r in make_runs(pso=[9.0], ga=[9.0])]
    assert write_headlines(compare_problems(failed)) == (
        "On most of the 5 problems GA and PSO mostly find no feasible point.",
    )


def fail(run: RunRecord) -> RunRecord:
    return replace(run, x={}, feasible=False, objective=np.nan, counts={"f": 30})


@pytest.mark.parametrize(
    ("ends", "failed", "known", "headline"),
    [
        ([9.0, 9.5, 9.2], 2, None, "PSO fails in 2 of 3 runs; the best run ends at 9.200000 W."),
        ([12.0, None, None], 0, PROVEN, "PSO ends infeasible in 2 of 3 runs; the best run ends 20 % above the proven optimum "
         "10.000000 W."),
        ([12.0, None, 10.0], 1, PROVEN, "PSO fails in 1 of 3 runs and ends infeasible in 1 of 3 runs; the best run reaches the "
         "proven optimum 10.000000 W."),
        ([12.0, 12.0], 2, None, "None of the 2 runs of PSO is feasible: each failed."),
        ([12.0], 1, None, "The only run, of PSO, failed."),
        ([12.0], 0, None, "The only PSO run ends at 12.000000 W; no best known value is shipped."),
    ],
)  # fmt: skip
def test_failed_and_infeasible_runs_are_different(
    ends: list[float | None], failed: int, known: Reference | None, headline: str
) -> None:
    runs = [fail(run) if k < failed else run for k, run in enumerate(make_runs(pso=ends))]
    assert describe(runs, known) == headline


def test_medians_of_effort_are_those_of_runs_with_a_result_and_a_gap_from_zero_has_a_unit() -> None:
    runs = make_runs(pso=[0.0, 0.5, 9.0], ga=[9.0])
    (comparison,) = compare_problems([fail(run) if run.objective == 9.0 else run for run in runs])
    header, (pso, ga) = format_rows(comparison)
    shown = [dict(zip(header, row, strict=True)) for row in (pso, ga)]
    assert (shown[0]["median evaluations"], shown[0]["best gap"], shown[0]["median gap"]) == ("10", "0 W", "0.5 W")
    assert (shown[1]["median evaluations"], shown[1]["median time [s]"]) == ("-", "-")


def bowl(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """A bowl with the least value 10 at (0.5, 0)."""
    return 10 + (x - 0.5) ** 2 + y**2, (row(x + y, lower=limit),)


def test_what_certainty_proved_in_a_folder_is_known_there(tmp_path: Path) -> None:
    problem = toy(bowl, limit=-1.0)
    certificate = certify(problem, np.array([0.5, 0.0]), tolerance=1e-7, time_limit_s=60.0)
    (tmp_path / "certainty").mkdir()
    path = tmp_path / "certainty" / "toy-certificate.json"
    path.write_text(json.dumps(asdict(make_certificate_file(problem, certificate))))
    (tmp_path / "certainty" / "broken-certificate.json").write_text("{}")
    runs = [replace(r, inputs=replace(r.inputs, problem=identify_problem(problem))) for r in make_runs(pso=[10.1] * 3)]
    (comparison,) = compare_problems(runs, folder=tmp_path / "results")
    assert write_headline(comparison) == "PSO's median run ends 1.0 % above the proven optimum 10.000000 W."
    assert comparison.known.source == (
        "proven to six digits by `nlp-gait certainty` on this machine (toy-certificate.json)"
    )
    assert "best value found" in write_headline(compare_problems(runs, folder=tmp_path)[0])  # another folder
    better = [replace(runs[0], objective=9.9), *runs[1:]]
    (contradicted,) = compare_problems(better, folder=tmp_path / "results")
    assert contradicted.reference == 9.9 and "which is not used" in contradicted.known.source


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
