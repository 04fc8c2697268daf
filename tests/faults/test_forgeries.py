"""No forged record influences a report: each is excluded by name, and the numbers are those of the honest records."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.study.evidence import Scope, read_evidence
from compare.study.record import parse_record
from compare.study.record_files import RECORDS, read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop
from tests.faults.forgeries import Forgery, Records, forge_between_samples, forge_records

STUDY = StudySettings(
    problems=(ProblemSpec(name="walk12", values={"lambda": 0.4}),),
    solvers=(SolverSpec(name="pso"), SolverSpec(name="ipopt")),
    runs=3,
    starts=3,
    stop=Stop(evaluations=400),
)
FORGERIES = list(forge_records())
BETWEEN = list(forge_between_samples())


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Records:
    """The plain records of an honest study."""
    folder = tmp_path_factory.mktemp("study")
    run_study(Study(tasks=STUDY.tasks(), folder=folder))
    assert read_evidence(folder, "all").excluded == []
    return {path.stem: json.loads(path.read_text()) for path in folder.glob(f"{RECORDS}/*/*.json")}


def compare_files(records: Records, folder: Path, scope: Scope = "best") -> tuple[Comparison, list[str]]:
    for name, raw in records.items():
        (folder / RECORDS / "walk12").mkdir(parents=True, exist_ok=True)
        (folder / RECORDS / "walk12" / f"{name}.json").write_text(json.dumps(raw))
    evidence = read_evidence(folder, scope)
    return compare_problems(evidence.records)[0], [exclusion.sentence for exclusion in evidence.excluded]


def describe(comparison: Comparison) -> object:
    """Return what a verdict is made of."""
    solvers = {
        s.name: (s.costs, [c.gap.tolist() for c in s.curves], [r.x for r in s.records]) for s in comparison.solvers
    }
    return comparison.reference, comparison.known, solvers


def test_there_are_enough() -> None:
    assert len(FORGERIES) + len(BETWEEN) >= 80 and len({forgery.name for forgery in FORGERIES}) == len(FORGERIES)


@pytest.mark.parametrize("forgery", FORGERIES + BETWEEN, ids=lambda forgery: forgery.name)
def test_a_forged_record_is_named_and_without_influence(forgery: Forgery, honest: Records, tmp_path: Path) -> None:
    forged: Records = json.loads(json.dumps(honest))
    forgery.apply(forged)
    found, sentences = compare_files(forged, tmp_path / "forged", "all" if forgery in BETWEEN else "best")
    solver, run = forgery.victim.split("-")
    names = (f"walk12, {solver}, run {int(run)}:", f"{RECORDS}/walk12/{forgery.victim}.json:")
    assert len(sentences) == 1 and sentences[0].startswith(names), sentences
    rest = [parse_record(raw) for name, raw in sorted(honest.items()) if name != forgery.victim]
    assert describe(found) == describe(compare_problems(rest)[0])


def test_a_forged_record_is_computed_again_when_the_study_continues(honest: Records, tmp_path: Path) -> None:
    forged: Records = json.loads(json.dumps(honest))
    forged["pso-0001"]["verdict"]["objective"] = 0.99
    forged["pso-0002"]["origin"]["code_sha256"] = "f" * 64
    compare_files(forged, tmp_path)
    said: list[str] = []
    run_study(Study(tasks=STUDY.tasks(), folder=tmp_path), on_outdated=said.append)
    assert len(said) == 2 and "its objective is 0.99" in said[0] and "other code" in said[1]
    again = {(r.solver, r.run): r.verdict.objective for r in read_records(tmp_path)}
    assert again["pso", 1] == honest["pso-0001"]["verdict"]["objective"]
