"""The answer of a study: gaps from the shipped best known value of exactly this problem, what is proven, what chance may be."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

import nlp_gait
from compare.analysis.best_known import describe_value
from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.headline import write_headline, write_headlines
from compare.analysis.record_statistics import find_best_known
from compare.report.study_report import write_better_points
from compare.study.record import RunRecord
from compare.study.references import Reference, find_reference
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait.backends.identity import identify_problem
from nlp_gait.formulation.result import load_result
from nlp_gait.proofs.certificate import load_certificates
from tests.compare.records import record, study

CERTIFIED = load_certificates()["walk12-lambda-0.4"].problem


@pytest.fixture(scope="module")
def runs() -> list[RunRecord]:
    """Two short runs of a search without IPOPT."""
    spec = ProblemSpec(name="walk12", options=CERTIFIED["options"], values=CERTIFIED["parameters"])
    tasks = [Task(problem=spec, solver="pso", stop=Stop(evaluations=300), run=run) for run in range(2)]
    return run_study(Study(tasks=tuple(tasks)))


def compare_with(known: Reference, runs: list[RunRecord]) -> Comparison:
    comparison = compare_problems(runs, references={} if known.objective is None else {"walk12": known.objective})[0]
    return replace(comparison, known=known)


def test_a_study_without_ipopt_is_measured_from_the_shipped_value(runs: list[RunRecord]) -> None:
    (comparison,) = compare_problems(runs)
    assert comparison.reference == find_reference(CERTIFIED).objective != find_best_known(runs)
    assert comparison.best is not None
    value = comparison.best.verdict.objective
    assert comparison.gap(-value) == pytest.approx((comparison.reference - value) / comparison.reference)
    assert "proven optimal to six digits. Median runs end below it by pso" in write_headline(comparison)


def test_a_better_run_is_announced_and_offered(runs: list[RunRecord], tmp_path: Path) -> None:
    comparison = compare_with(Reference(objective=0.5, source="shipped, best of 2 starts"), runs)
    assert "This is a new best known value: " in write_headline(comparison)
    assert comparison.gap(comparison.solvers[0].costs[0]) < 0.0
    (path,) = write_better_points(tmp_path, [comparison])
    written = load_result(path)
    assert comparison.best is not None and written.problem.by_name(written.x) == comparison.best.x
    assert json.loads(path.read_text())["best_known_before"]["objective"] == 0.5


def test_a_record_that_only_claims_to_be_better_is_not_offered(runs: list[RunRecord], tmp_path: Path) -> None:
    forged = [replace(r, verdict=replace(r.verdict, objective=0.99)) for r in runs]
    comparison = compare_with(Reference(objective=0.95), forged)
    assert comparison.better is not None and write_better_points(tmp_path, [comparison]) == []


def test_less_than_the_tolerance_is_no_gain(runs: list[RunRecord]) -> None:
    best = max(r.verdict.objective for r in runs)
    comparison = compare_with(Reference(objective=best * (1 - 5e-7)), runs)
    assert comparison.better is None and comparison.gap(-best) == 0.0


def test_a_single_value_is_compared_with_the_shipped_one() -> None:
    phase = nlp_gait.load("nao-ssp")
    known, objective = find_reference(identify_problem(phase)), phase.objective
    assert describe_value(known, 0.8543274, objective).endswith("this point is 1.0000 % from it")
    assert "contribute" in describe_value(known, 0.84, objective)
    other = find_reference(identify_problem(phase.with_values(reach_margin=0.02)))
    assert describe_value(other, 0.84, objective) == "Best known value: none is shipped for these settings"


def test_the_headline_of_a_study_by_hand() -> None:
    """Medians over all runs: newton 10, swarm 10.55, colony 11.75 W; no pair differs significantly."""
    assert write_headline(compare_problems(study())[0]) == (
        "On walk the best power is 10.000000 W, the best of this study; none is shipped for this problem. Median runs end above "
        "it by swarm 5.5 %, colony 18 % (too few runs for a test); newton "
        "reaches it in 2 of 3 runs (0.5 s)."
    )


def test_the_users_solver_is_the_subject_with_those_that_it_differs_from() -> None:
    values = {"mine": 10.02, "pso": 10.5, "ipopt": 10.0, "near": 10.021}
    records = []
    for solver, value in values.items():
        for run in range(12):
            made = record(solver, run, [(10, value + 2e-3 * run * (solver != "ipopt"))])
            code = {"solver": {"name": "my.py:mine", "source_sha256": "0" * 64}} if solver == "mine" else {}
            records.append(replace(made, inputs=replace(made.inputs, **code)))
    assert write_headline(compare_problems(records)[0]) == (
        "On walk mine ends 0.31 % above the best power (median of 12 runs, behind ipopt, before pso), which is 10.000000 W, the "
        "best of this study; none is shipped for this problem. Median runs end above it by near 0.32 %, pso 5.1 % (mine before "
        "near: p = 0.75); ipopt reaches it in 12 of 12 starts (0.1 s)."
    )


def test_many_problems_have_one_headline_and_infeasible_ones_a_plain_one() -> None:
    failed = [record("pso", run, [(10, None)], feasible=False) for run in range(2)]
    assert write_headlines(compare_problems(failed)) == ("On walk no run is feasible: pso.",)
    many = [replace(r, problem=f"walk-{k}") for k in range(5) for r in study()]
    (headline,) = write_headlines(compare_problems(many))
    assert headline == (
        "The median over 5 problems of the median gap is: newton 0.0000 %, swarm 5.5000 % and colony 17.5000 %. Best known "
        "values reached, of 5: newton on 5."
    )
