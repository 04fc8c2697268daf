"""A study grows in its folder: records are kept by what they depend on, and nothing is deleted."""

from __future__ import annotations

import json
import linecache
import sys
import types
from dataclasses import replace
from pathlib import Path

import pytest

from compare.study.definition import hash_solver_source
from compare.study.record import RunRecord
from compare.study.record_files import locate_record, read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop
from nlp_gait.errors import InputError
from tests.robots.custom import humanoid

STUDY = StudySettings(
    problems=(ProblemSpec(name="walk12"),),
    solvers=(SolverSpec(name="pso"), SolverSpec(name="ga")),
    runs=2,
    stop=Stop(evaluations=200),
)


def grown(folder: Path, settings: StudySettings) -> tuple[list[RunRecord], int, list[str]]:
    """Records, how many were kept, and what is reported of runs that are recomputed."""
    kept: list[int] = []
    said: list[str] = []
    records = run_study(Study(tasks=settings.tasks(), folder=folder), on_stored=kept.append, on_outdated=said.append)
    return records, kept[0], said


def test_more_runs_solvers_and_problems_continue_what_is_there(tmp_path: Path) -> None:
    assert grown(tmp_path, STUDY)[1:] == (0, [])
    assert grown(tmp_path, replace(STUDY, runs=4))[1:] == (4, [])
    assert grown(tmp_path, replace(STUDY, solvers=(*STUDY.solvers, SolverSpec(name="de"))))[1:] == (4, [])
    small = ProblemSpec(name="walk12", label="slow", values={"lambda": 1.0})
    assert grown(tmp_path, replace(STUDY, problems=(*STUDY.problems, small)))[1:] == (4, [])
    assert len(read_records(tmp_path)) == 8 + 2 + 4


def test_records_of_other_code_stay_until_a_run_is_missing_and_are_recomputed_once(tmp_path: Path) -> None:
    settings = replace(STUDY, solvers=STUDY.solvers[:1], stop=Stop(evaluations=50))
    grown(tmp_path, settings)
    for path in (tmp_path / "records" / "walk12").glob("*.json"):
        record = json.loads(path.read_text())
        record["origin"]["code_sha256"] = "f" * 64
        path.write_text(json.dumps(record))
    assert grown(tmp_path, settings)[1:] == (2, [])
    more = replace(settings, runs=3)
    _, kept, said = grown(tmp_path, more)
    assert (
        kept == 0
        and len(said) == 1
        and said[0].startswith("pso on walk12: 2 runs recomputed: it was computed by other")
    )
    assert grown(tmp_path, more)[1:] == (3, [])


def test_a_larger_budget_is_another_run_and_the_smaller_ones_stay(tmp_path: Path) -> None:
    first = grown(tmp_path, STUDY)[0]
    more = replace(STUDY, stop=Stop(evaluations=300))
    records, kept, said = grown(tmp_path, more)
    assert kept == 0 and said == [f"{s} on walk12: 2 runs recomputed: evaluations 200 -> 300" for s in ("pso", "ga")]
    assert {r.evaluations["f"] for r in records} == {300}
    assert sorted(r.evaluations["f"] for r in read_records(tmp_path)) == [200] * 4 + [300] * 4
    again, kept, said = grown(tmp_path, STUDY)
    assert kept == 4 and not said and again == first


def test_a_solver_that_is_left_out_is_hidden_and_stays_stored(tmp_path: Path) -> None:
    grown(tmp_path, STUDY)
    records, kept, _ = grown(tmp_path, replace(STUDY, solvers=STUDY.solvers[:1]))
    assert {r.solver for r in records} == {"pso"} and kept == 2
    assert {r.solver for r in read_records(tmp_path)} == {"pso", "ga"}


def test_a_polished_run_is_of_the_settings_of_its_search(tmp_path: Path) -> None:
    def polishing(population: int) -> StudySettings:
        solver = SolverSpec(name="pso", label="swarm", settings={"population": population}, polish=True)
        return replace(STUDY, solvers=(solver,), runs=1)

    grown(tmp_path, polishing(20))
    _, kept, said = grown(tmp_path, polishing(30))
    assert kept == 0 and said == [
        "swarm on walk12: 1 run recomputed: population 20 -> 30",
        "swarm+ipopt on walk12: 1 run recomputed: the search that it polishes",
    ]


@pytest.mark.slow
def test_a_robot_is_its_content_wherever_its_file_lies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_compiler: None
) -> None:
    """Made heavier, it is another problem; moved, it is the same."""

    def study(robot: str) -> StudySettings:
        spec = ProblemSpec(name="nao-ssp", options={"robot": robot})
        return replace(STUDY, problems=(spec,), solvers=STUDY.solvers[:1], runs=1)

    out, elsewhere = tmp_path / "study", tmp_path / "elsewhere"
    elsewhere.mkdir()
    for folder in (tmp_path, elsewhere):
        (folder / "my.json").write_text(json.dumps(humanoid()))
    monkeypatch.chdir(tmp_path)
    (first,), kept, said = grown(out, study("my.json"))
    assert grown(out, study(str(elsewhere / "my.json")))[1:] == (1, [])
    heavier = humanoid()
    heavier["links"]["torso"]["mass_kg"] *= 1.5
    (elsewhere / "my.json").write_text(json.dumps(heavier))
    monkeypatch.chdir(elsewhere)
    (second,), kept, said = grown(out, study("my.json"))
    assert kept == 0 and said == ["pso on nao-ssp: 1 run recomputed: the file of robot"]
    assert second.verdict.objective != first.verdict.objective
    monkeypatch.chdir(tmp_path)
    assert grown(out, study("my.json"))[1:] == (1, [])


def test_a_copy_of_a_record_under_a_key_is_refused(tmp_path: Path) -> None:
    grown(tmp_path, STUDY)
    path = locate_record(tmp_path, STUDY.tasks()[0])
    path.with_name(f"{path.stem}.00000000.json").write_text(path.read_text())
    with pytest.raises(InputError, match="belongs to walk12/pso-0000.json"):
        read_records(tmp_path)


def test_an_algorithm_of_a_notebook_has_no_source_to_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a class of a main module without a file, nor a function whose text only the notebook knows."""
    notebook = types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", notebook)
    text = "class Mine: ...\ndef search(f, lower, upper, evaluations, seed): ...\n"
    monkeypatch.setitem(linecache.cache, "/tmp/ipykernel_1/1.py", (len(text), None, text.splitlines(True), ""))
    exec(compile(text, "/tmp/ipykernel_1/1.py", "exec"), notebook.__dict__)
    assert hash_solver_source(notebook.Mine()) is None and hash_solver_source(notebook.search) is None
    assert hash_solver_source(test_an_algorithm_of_a_notebook_has_no_source_to_hash) is not None
