"""Verification finds honest mistakes by computing again, and packed code runs only if it is allowed to."""

import json
import os
import shutil
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from compare.study.pack import INDEX, pack_study, unpack_archive
from compare.study.run import ProblemSpec, plan_runs
from compare.study.study import Study, read_records, run_study, write_records
from compare.study.verify import Difference, Verification, compute_chance, verify_study
from nlp_gait.errors import InputError
from tests.robots.custom import humanoid

WALK = ProblemSpec(name="walk12")


def make_study(folder: Path, *solvers: str, problem: ProblemSpec = WALK, runs: int = 3) -> Path:
    planned = plan_runs([problem], [("", name) for name in solvers], runs=runs, starts=1, evaluations=100)
    run_study(Study(runs=planned, folder=folder, jobs=2))
    return folder


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_study(tmp_path_factory.mktemp("sound") / "study", "pso", "ga", "ipopt")


def find(folder: Path, solver: str, run: int = 0) -> Path:
    (path,) = folder.glob(f"records/walk12/{solver}-{run:04d}-*.json")
    return path


def edit(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def describe(verification: Verification) -> str:
    return "\n".join(" ".join(row) for row in verification.rows)


@pytest.mark.commit
def test_an_honest_study_holds_and_all_of_its_runs_are_repeated(sound: Path) -> None:
    verification = verify_study(sound)
    assert verification.holds and not verification.rows
    assert verification.sentence == "7 points evaluated and 7 of 7 runs repeated: nothing differs"


def test_a_share_says_how_likely_altered_runs_would_pass(sound: Path) -> None:
    verification = verify_study(sound, share=0.2)
    assert verification.repeated == 2 and "would pass with probability 0.71" in verification.sentence
    assert compute_chance(106, 21) == pytest.approx(0.0982, abs=1e-4)  # 85/106 * 84/105 * ...: none of 10 is among 21


Alteration = Callable[[dict[str, Any]], object]
# Of a run by its solver and number.
ALTERATIONS: dict[tuple[str, int], tuple[Alteration, str]] = {
    ("pso", 0): (lambda r: r.update(objective=0.99), "its objective is 0.99, but that of its x is"),
    ("pso", 1): (lambda r: r["metrics"].update({next(iter(r["metrics"])): 7.0}), "is 7, but that of its x is"),
    ("pso", 2): (lambda r: r["x"].popitem(), "must name every variable once"),
    ("ga", 0): (lambda r: r["history"]["objective"].__setitem__(-1, 0.9), "history: recorded"),
    ("ga", 1): (lambda r: r["counts"].update(f=99), "counts: recorded"),
    ("ga", 2): (lambda r: r.update(status="converged"), "status: recorded '\"converged\"'"),
    ("ipopt", 0): (lambda r: r.update(feasible=False), "it is called infeasible"),
}


def test_a_study_of_which_nothing_is_checked_is_said_to_be_unchecked(sound: Path) -> None:
    rows, (records, _) = [Difference("pso, run 0", "not repeated", "its code is not named")], read_records(sound)
    verification = Verification(rows=rows, records=records, repeated=0, evaluated=0)
    assert verification.sentence == "no run was checked, for the reasons above"
    assert not verification.holds


def test_edited_records_are_named(sound: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(sound, tmp_path / "study")
    for (solver, run), (change, _) in ALTERATIONS.items():
        edit(find(folder, solver, run), change)
    verification = verify_study(folder)
    assert not verification.holds
    for (solver, run), (_, message) in ALTERATIONS.items():
        named = f"walk12, {solver}, run {run}"
        assert any(row[0].startswith(named) and message in " ".join(row) for row in verification.rows), named


def test_a_run_of_another_version_is_named_and_holds(sound: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(sound, tmp_path / "study")
    edit(find(folder, "ga"), lambda record: record["versions"].update(casadi="3.0.0"))
    verification = verify_study(folder)
    assert "computed by version 3.0.0" in describe(verification) and verification.holds


def test_copied_points_missing_runs_and_damaged_records_are_named(sound: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(sound, tmp_path / "study")
    best = json.loads(find(folder, "ga").read_text())
    judged = ("x", "objective", "violation", "metrics", "reported_objective", "history", "time_s")
    edit(find(folder, "pso"), lambda record: record.update({name: best[name] for name in judged}))
    find(folder, "ga", 1).unlink()
    find(folder, "ga", 2).write_text("{")
    text = describe(verify_study(folder))
    assert "walk12, pso, run 0 differs" in text and "is not valid JSON" in text
    assert "walk12/ga-0001-" in text and "missing study.json lists it" in text


def test_runs_under_the_label_of_another_solver_or_problem_are_named(sound: Path, tmp_path: Path) -> None:
    record = next(record for record in read_records(sound)[0] if record.solver == "pso")
    write_records(
        [replace(record, solver="ga", run=k, problem=p) for k, p in enumerate(("walk12", "nao-ssp"))], tmp_path
    )
    text = describe(verify_study(tmp_path, share=0.0))
    assert "it is named 'ga', but its inputs are those of 'pso'" in text
    assert "it is named 'nao-ssp', but its inputs are those of 'walk12'" in text


PROGRAM = """
import json, random, sys
def main():
    head = json.loads(sys.stdin.readline())
    draw = random.Random(head["seed"])
    while True:
        x = [draw.uniform(low, high) for low, high in zip(head["lower"], head["upper"])]
        print(json.dumps({"x": [x]}), flush=True)
        if json.loads(sys.stdin.readline()).get("stop"):
            return
main()
"""


def test_an_archive_with_a_program_and_code_is_verified_in_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    for folder in (home, elsewhere):
        folder.mkdir()
    monkeypatch.chdir(home)
    mark = tmp_path / "it-ran"
    Path("es.py").write_text(PROGRAM)
    Path("helper.py").write_text("SHARE = 0.5\n")
    Path("mine.py").write_text(
        "import pathlib, helper\ndef search(f, lower, upper, evaluations, seed):\n"
        f" pathlib.Path({str(mark)!r}).touch()\n f(lower + helper.SHARE * (upper - lower))\n"
    )
    program = f"cmd:{sys.executable} es.py"
    study = make_study(home / "study", program, "mine.py:search", runs=2)
    records, _ = read_records(study)
    archive = pack_study(study, records, tmp_path / "study.zip")
    monkeypatch.chdir(elsewhere)
    for name in ("es.py", "mine.py", "helper.py"):
        (home / name).unlink()
    mark.unlink()
    unpack_archive(archive, elsewhere / "unpacked")
    text = describe(verify_study(elsewhere / "unpacked"))
    assert text.count("is packed, and runs only with --run-code") == 2 and not mark.exists()
    verification = verify_study(elsewhere / "unpacked", run_code=True)
    assert verification.sentence == "4 points evaluated and 4 of 4 runs repeated: nothing differs" and mark.exists()
    index = json.loads((elsewhere / "unpacked" / INDEX).read_text())
    for place in index.values():
        (elsewhere / "unpacked" / place).write_text("print('another')\n")
    assert "is not the code that computed it" in describe(verify_study(elsewhere / "unpacked", run_code=True))


def test_a_packed_robot_stands_for_the_authors_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = tmp_path / "robots" / "my.json"
    robot.parent.mkdir()
    robot.write_text(json.dumps(humanoid()))
    spec = ProblemSpec(name="nao-ssp", options={"robot": str(robot)})
    study = make_study(tmp_path / "study", "random", problem=spec, runs=1)
    archive = pack_study(study, read_records(study)[0], tmp_path / "study.zip")
    robot.unlink()
    unpack_archive(archive, tmp_path / "unpacked")
    assert verify_study(tmp_path / "unpacked").sentence == "1 point evaluated and 1 of 1 runs repeated: nothing differs"


def bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("study.json", b"0" * 2**24)


def leave(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("../study.json", "{}")


def link(path: Path) -> None:
    entry = zipfile.ZipInfo("study.json")
    entry.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(entry, "/etc/passwd")


def nest(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("/".join("d" * 70) + "/x", "")


def crowd(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for number in range(10_001):
            archive.writestr(str(number), "")


@pytest.mark.parametrize("make", [bomb, nest, crowd, os.mkfifo, Path.mkdir, lambda path: path.write_text("PK")])
def test_no_archive_harms(make: Callable[[Path], object], tmp_path: Path) -> None:
    make(tmp_path / "study.zip")
    with pytest.raises(InputError, match="archive .*(compressed too well|folders deep|more than|regular|damaged)"):
        unpack_archive(tmp_path / "study.zip", tmp_path / "unpacked")
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and path.name != "study.zip"]


@pytest.mark.parametrize("make", [leave, link])
def test_an_archive_stays_in_its_folder_and_makes_no_links(make: Callable[[Path], object], tmp_path: Path) -> None:
    make(tmp_path / "study.zip")
    unpack_archive(tmp_path / "study.zip", tmp_path / "unpacked")
    assert [path.name for path in (tmp_path / "unpacked").iterdir()] == ["study.json"]
    assert not (tmp_path / "study.json").exists() and not (tmp_path / "unpacked" / "study.json").is_symlink()
