"""A study grows in its folder: a run's file is named after its inputs; ``study.json`` lists those that belong to it."""

import json
import linecache
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from compare.study.record import RunRecord
from compare.study.run import ProblemSpec, Run, make_inputs, plan_runs
from compare.study.study import RECORDS, Study, read_records, read_study_file, run_study
from metaheuristics import ParticleSwarm
from tests.robots.custom import humanoid

WALK, PSO, GA = ProblemSpec(name="walk12"), ("", "pso"), ("", "ga")
STUDY = {"problems": [WALK], "solvers": [PSO, GA], "runs": 2, "starts": 1, "evaluations": 200}


def grow(folder: Path, **changes: Any) -> tuple[list[RunRecord], int]:
    """Return the records of a study, and how many of them were stored before."""
    stored: list[int] = []
    records = run_study(Study(runs=plan_runs(**{**STUDY, **changes}), folder=folder), on_stored=stored.append)
    return records, stored[0]


def count_files(folder: Path) -> int:
    return len(list((folder / RECORDS).rglob("*.json")))


def test_more_runs_solvers_and_problems_continue_what_is_there(tmp_path: Path) -> None:
    assert grow(tmp_path)[1] == 0
    assert grow(tmp_path, runs=4)[1] == 4
    assert grow(tmp_path, solvers=[PSO, GA, ("", "de")])[1] == 4
    slow = ProblemSpec(name="walk12", label="slow", values={"lambda": 1.0})
    assert grow(tmp_path, problems=[WALK, slow])[1] == 4
    assert count_files(tmp_path) == 8 + 2 + 4


CHANGES: dict[str, dict[str, Any]] = {
    "budget": {"evaluations": 300},
    "seed": {"seed": 7},
    "handling": {"handling": "penalty=2"},
    "settings": {"solvers": [("pso", ParticleSwarm(population=20))]},
    "parameter": {"problems": [ProblemSpec(name="walk12", values={"lambda": 0.5})]},
    "option": {"problems": [ProblemSpec(name="walk12", options={"intervals": 10})]},
}


@pytest.mark.parametrize("change", CHANGES)
def test_other_inputs_never_overwrite_a_run_and_the_report_shows_the_latest(change: str, tmp_path: Path) -> None:
    """The same command as before finds its runs again, and lists them."""
    first: dict[str, Any] = {"solvers": [PSO], "runs": 1}
    begun, _ = grow(tmp_path, **first)
    records, stored = grow(tmp_path, **{**first, **CHANGES[change]})
    assert stored == 0 and count_files(tmp_path) == 2
    assert read_records(tmp_path) == (records, []) and records != begun
    assert grow(tmp_path, **first) == (begun, 1)
    assert read_records(tmp_path) == (begun, [])


def test_a_gradient_run_depends_only_on_what_it_heeds() -> None:
    def find(solver: str, **stop: Any) -> str:
        return make_inputs([Run(problem=WALK, solver=solver, **stop)])[0].key

    assert find("ipopt", evaluations=300) == find("ipopt", evaluations=400)
    assert find("ipopt", time_limit_s=9.0) != find("ipopt")
    assert find("slsqp", evaluations=300) != find("slsqp", evaluations=400)


def test_a_robot_is_its_content_wherever_its_file_lies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_compiler: None
) -> None:
    """Made heavier, it is another problem; moved, it is the same."""

    def grow_for(robot: str) -> tuple[list[RunRecord], int]:
        return grow(out, problems=[ProblemSpec(name="nao-ssp", options={"robot": robot})], solvers=[PSO], runs=1)

    out, elsewhere = tmp_path / "study", tmp_path / "elsewhere"
    elsewhere.mkdir()
    for folder in (tmp_path, elsewhere):
        (folder / "my.json").write_text(json.dumps(humanoid()))
    monkeypatch.chdir(tmp_path)
    (first,), _ = grow_for("my.json")
    assert grow_for(str(elsewhere / "my.json"))[1] == 1
    heavier = humanoid()
    heavier["links"]["torso"]["mass_kg"] *= 1.5
    (elsewhere / "my.json").write_text(json.dumps(heavier))
    monkeypatch.chdir(elsewhere)
    (second,), stored = grow_for("my.json")
    assert stored == 0 and second.objective != first.objective
    monkeypatch.chdir(tmp_path)
    assert grow_for("my.json")[1] == 1


def test_the_list_of_runs_has_each_once_in_any_order_of_commands(tmp_path: Path) -> None:
    for changes in ({}, {"solvers": [GA], "runs": 3}, {}):
        grow(tmp_path, **changes)
    runs = read_study_file(tmp_path).runs
    assert sorted(name.rpartition("-")[0] for name in runs) == [
        f"walk12/{solver}-000{run}" for solver in ("ga", "pso") for run in (0, 1)
    ]


def test_an_algorithm_of_a_notebook_has_no_source_to_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a class of a main module without a file, nor a function whose text only the notebook knows."""
    notebook = types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", notebook)
    text = "class Mine: ...\ndef search(f, lower, upper, evaluations, seed): ...\n"
    monkeypatch.setitem(linecache.cache, "/tmp/ipykernel_1/1.py", (len(text), None, text.splitlines(True), ""))
    exec(compile(text, "/tmp/ipykernel_1/1.py", "exec"), notebook.__dict__)
    for solver, has_file in ((notebook.search, False), (search, True)):
        (inputs,) = make_inputs([Run(problem=WALK, solver=solver)])
        assert ("file_sha256" in inputs.solver) == has_file


def search(f: Any, lower: Any, upper: Any, evaluations: int, seed: int) -> None:
    f(lower)
