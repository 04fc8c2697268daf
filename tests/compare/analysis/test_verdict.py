"""Gaps are measured from the shipped best known value of exactly this problem, with its bound and its source in words."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

import nlp_gait
from compare.analysis import comparison as comparisons
from compare.analysis.best_known import describe_value
from compare.analysis.better_points import write_better_points
from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.record_statistics import find_best_known
from compare.analysis.verdict import describe_best_known, describe_better, write_verdict
from compare.study.record import RunRecord
from compare.study.references import Reference, find_reference
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait.backends.identity import identify_problem
from nlp_gait.formulation.result import load_result
from nlp_gait.proofs.certificate import load_certificates

CERTIFIED = load_certificates()["walk12-lambda-0.4"].problem


@pytest.fixture(scope="module")
def runs() -> list[RunRecord]:
    """Two short runs of a search without IPOPT."""
    spec = ProblemSpec(name="walk12", options=CERTIFIED["options"], values=CERTIFIED["parameters"])
    tasks = [Task(problem=spec, solver="pso", stop=Stop(evaluations=300), run=run) for run in range(2)]
    return run_study(Study(tasks=tuple(tasks)))


def compare_with(known: Reference, runs: list[RunRecord], monkeypatch: pytest.MonkeyPatch) -> Comparison:
    monkeypatch.setattr(comparisons, "find_reference", lambda problem: known)
    return compare_problems(runs)[0]


def test_a_study_without_ipopt_is_measured_from_the_shipped_value(runs: list[RunRecord]) -> None:
    (comparison,) = compare_problems(runs)
    assert comparison.reference == find_reference(CERTIFIED).objective != find_best_known(runs, comparison.objective)
    assert comparison.best is not None
    own = comparison.best.verdict.objective
    assert comparison.gap(-own) == pytest.approx((comparison.reference - own) / comparison.reference)
    assert "shipped, proven to" in write_verdict([comparison])[0]
    assert "no feasible point is better than" in describe_best_known(comparison)
    assert describe_better(comparison) == ""


def test_a_better_run_is_said_to_be_better_and_offered(
    runs: list[RunRecord], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    comparison = compare_with(Reference(objective=0.5, source="shipped, best of 2 starts"), runs, monkeypatch)
    assert "a new best known value was found" in describe_better(comparison)
    assert comparison.gap(comparison.solvers[0].costs[0]) < 0.0
    (path,) = write_better_points(tmp_path, [comparison])
    written = load_result(path)
    assert comparison.best is not None and written.problem.by_name(written.x) == comparison.best.x
    assert json.loads(path.read_text())["best_known_before"]["objective"] == 0.5


def test_a_record_that_only_claims_to_be_better_is_not_offered(
    runs: list[RunRecord], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forged = [replace(r, verdict=replace(r.verdict, objective=0.99)) for r in runs]
    comparison = compare_with(Reference(objective=0.95), forged, monkeypatch)
    assert comparison.better is not None and write_better_points(tmp_path, [comparison]) == []


def test_less_than_the_tolerance_is_no_gain(runs: list[RunRecord], monkeypatch: pytest.MonkeyPatch) -> None:
    best = max(r.verdict.objective for r in runs)
    comparison = compare_with(Reference(objective=best * (1 - 5e-7)), runs, monkeypatch)
    assert comparison.better is None and comparison.gap(-best) == 0.0


def test_without_a_shipped_value_the_best_of_the_study_is_the_reference(
    runs: list[RunRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    comparison = compare_with(Reference(), runs, monkeypatch)
    assert comparison.reference == max(r.verdict.objective for r in runs)
    assert "the best of this study" in describe_best_known(comparison)


def test_a_single_value_is_compared_with_the_shipped_one() -> None:
    phase = nlp_gait.load("nao-ssp")
    known, objective = find_reference(identify_problem(phase)), phase.objective
    assert describe_value(known, 0.8543274, objective).endswith("this point is 1.0000 % from it")
    assert "contribute" in describe_value(known, 0.84, objective)
    other = find_reference(identify_problem(phase.with_values(reach_margin=0.02)))
    assert describe_value(other, 0.84, objective) == "Best known value: none is shipped for these settings"
