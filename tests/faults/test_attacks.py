"""Forged studies that are consistent in themselves are not called whole, and no user code judges itself."""

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.archive import verify_folder
from compare.report import write_report
from compare.study import settings
from compare.study.record import parse_record
from compare.study.record_files import RECORDS, name_run, read_records
from compare.study.run_study import Study, run_study
from compare.study.run_task import try_task
from compare.study.settings import FILE, SolverSpec, StudySettings, read_manifest
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait import load
from tests.compare.archive.forged_archives import change_places

Raw = dict[str, Any]
Forgery = Callable[[dict[str, Raw], Raw], object]  # of records by name, and study.json
SETTINGS = StudySettings(
    problems=(ProblemSpec(name="walk12", values={"lambda": 0.4}),),
    solvers=(SolverSpec(name="pso"), SolverSpec(name="ga"), SolverSpec(name="ipopt")),
    runs=3,
    starts=3,
    stop=Stop(evaluations=300),
)


@pytest.fixture(scope="module", autouse=True)
def one_core() -> Iterator[None]:
    """Let these tests see one processor: they repeat few runs, and each process would import and build everything again."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    usual = os.sched_getaffinity(0)
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    os.sched_setaffinity(0, {sorted(usual)[worker % len(usual)]})
    yield
    os.sched_setaffinity(0, usual)


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest")
    settings.write_manifest(folder, SETTINGS, settings.Session.begin("nlp-gait compare walk12", "1"))
    run_study(Study(tasks=SETTINGS.tasks(), folder=folder))
    write_report(folder, read_records(folder), read_manifest(folder))
    return folder


def edit(*changes: tuple[str, Any], solver: str = "pso") -> Forgery:
    """Return the forgery that changes places in all records of a solver."""

    def forge(records: dict[str, Raw], study: Raw) -> None:
        for raw in (raw for raw in records.values() if raw["solver"] == solver):
            change_places(raw, changes)

    return forge


def copy_points(source: str, target: str, *fields: str) -> Forgery:
    def forge(records: dict[str, Raw], study: Raw) -> None:
        donors = [raw for raw in records.values() if raw["solver"] == source]
        for donor, raw in zip(donors, [r for r in records.values() if r["solver"] == target], strict=False):
            raw |= {name: donor[name] for name in ("x", "verdict", "claimed_objective", "claimed_violation", *fields)}
            raw["history"]["objective"][-1] = donor["verdict"]["objective"]

    return forge


def drop(solver: str, *runs: int, renumber: bool = False, planned: bool = True) -> Forgery:
    """Return the forgery that deletes runs, and perhaps gives the others their numbers, or lists fewer."""

    def forge(records: dict[str, Raw], study: Raw) -> None:
        for name in [n for n, raw in records.items() if raw["solver"] == solver and raw["run"] in runs]:
            del records[name]
        rest = [raw for raw in records.values() if raw["solver"] == solver]
        for run, raw in enumerate(rest if renumber else []):
            raw["run"] = run
        if not planned:
            next(s for s in study["study"]["solver"] if s["name"] == solver)["runs"] = len(rest)

    return forge


def relabel(**labels: str) -> Forgery:
    def forge(records: dict[str, Raw], study: Raw) -> None:
        for raw in records.values():
            raw["solver"] = labels.get(raw["solver"], raw["solver"])

    return forge


def edit_text(name: str, old: str, new: str, folder: Path) -> None:
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))


HALF = ("evaluations.f", lambda f: f // 2), ("history.evaluations", lambda v: [max(1, e // 2) for e in v])


def list_forgeries() -> Iterator[tuple[str, Forgery | Callable[[Path], None]]]:
    """Yield consistent forgeries: of records and study.json, after which the files have their names again, or of texts."""
    for source in ("ipopt", "ga"):
        yield f"points of {source}", copy_points(source, "pso")
        counts = ("evaluations", "history", "time_s")
        yield f"points and counts of {source}", copy_points(source, "pso", "iterations", *counts)
        yield f"all but inputs of {source}", copy_points(source, "pso", "status", *counts)
    for solver in ("pso", "ipopt"):
        yield f"counts of {solver}", edit(*HALF, solver=solver)
        yield f"fewer iterations of {solver}", edit(("iterations", 1), solver=solver)
        yield f"status of {solver}", edit(("status", "target reached"), solver=solver)
        yield f"seeds of {solver}", edit(("inputs.seed", lambda s: s + 40), solver=solver)
        yield f"a setting of {solver}", edit(("settings.kind", "Other"), solver=solver)
        yield f"no failures of {solver}", edit(("failed_evaluations", lambda n: n + 1), solver=solver)
        yield f"run 1 of {solver} deleted", drop(solver, 1)
        yield f"run 1 of {solver} picked", drop(solver, 1, renumber=True)
        yield f"run 1 of {solver} picked, and planned", drop(solver, 1, renumber=True, planned=False)
        yield f"all of {solver} deleted", drop(solver, 0, 1, 2)
    yield "prices", edit(("active_constraints.0.price", lambda p: 2 * p), solver="ipopt")
    yield "a price less", edit(("active_constraints", lambda a: a[1:]), solver="ipopt")
    yield "guarantees", edit(("verdict.guaranteed.satisfied", lambda s: not s), ("verdict.guaranteed.reason", "?"))
    yield "history", edit(("history.objective", lambda v: [v[-1]] * len(v)))
    yield "budgets", edit(("inputs.stop.evaluations", 150), ("settings.population", 7))
    yield "a rival's label", relabel(pso="ga", ga="pso")
    yield "a new label", relabel(ga="weak")
    for name, old, new in (
        ("report.html", "pso", "pso*"), ("report.html", "ipopt", "IPOPT"), ("report.md", "pso", "mine"),
        ("report.md", "%", "% more"), ("walk12-final.svg", "pso", "mine"),
    ):  # fmt: skip
        yield f"{old!r} in {name}", partial(edit_text, name, old, new)


def find_forged(honest: Path, folder: Path, forgery: Callable[..., object]) -> str | None:
    """Return None if the verification of a forged study names something."""
    folder.mkdir()
    study = json.loads((honest / FILE).read_text())
    records = {path.stem: json.loads(path.read_text()) for path in sorted((honest / RECORDS).glob("*/*.json"))}
    if isinstance(forgery, partial):
        shutil.copytree(honest, folder, dirs_exist_ok=True)
        forgery(folder)
    else:
        forgery(records, study)
        study["runs"] = []
        for raw in records.values():
            name = name_run(parse_record(raw))
            path = folder / RECORDS / f"{name}.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(raw))
            study["runs"].append(name)
        (folder / FILE).write_text(json.dumps(study))
    findings = verify_folder(folder).findings
    return None if any(f.holds is False for f in findings) else "; ".join(f.sentence for f in findings)


CODE = {
    "points that are truth values": "f(lower > 0)",
    "more than its budget": "[f(lower) for _ in range(10**5)]",
    "a judge of its own": "f(lower)\n    import compare.study.run_task as r\n    r.evaluate = lambda p, x: None",
    "values of its own": "f(lower)\n    import gc\n    for o in gc.get_objects():\n"
    "        if type(o).__name__ == 'Evaluator': o.best, o.evaluations, o.best_x = (0.0, -9.0), 1, lower",
    "a channel of its own": "import os\n    [os.write(int(d), b'x') for d in os.listdir('/proc/self/fd') if int(d) > 2]",
    "another record": "import compare.study.record as r\n    f(lower)\n    r.RunRecord.to_json = lambda s: {'schema': 5}",
}  # fmt: skip


def run_code(name: str, folder: Path) -> str | None:
    """Return None if what is recorded is evaluated and counted by this process."""
    path = folder / f"{re.sub('[^a-z]', '_', name)}.py"
    path.write_text(f"def search(f, lower, upper, evaluations, seed):\n    {CODE[name]}\n")
    record = try_task(Task(problem=ProblemSpec(name="walk12"), solver=f"{path}:search", stop=Stop(evaluations=20)))
    if not record.x:
        return None if record.status.startswith("failed: ") else record.status
    problem = load("walk12")
    wrong = record.evaluations["f"] not in (1, 20) or not np.array_equal(list(record.x.values()), problem.lower)
    return f"{record.evaluations} {record.x}" if wrong and name != "more than its budget" else None


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, _ in list_forgeries()])
def test_no_consistent_forgery_is_called_whole(name: str, honest: Path, tmp_path: Path) -> None:
    assert find_forged(honest, tmp_path / "forged", dict(list_forgeries())[name]) is None


@pytest.mark.slow
def test_fewer_runs_that_are_planned_as_such_are_an_honest_study_of_fewer(honest: Path, tmp_path: Path) -> None:
    """What was run and never listed leaves no trace."""
    assert find_forged(honest, tmp_path / "forged", drop("ga", 2, planned=False)) is not None


@pytest.mark.slow
def test_the_honest_study_holds_and_says_what_was_not_checked(honest: Path) -> None:
    found = verify_folder(honest)
    assert all(finding.holds for finding in found.findings), [f.sentence for f in found.findings]
    assert "evaluated: 9 points; repeated: " in found.scope[0] and "times and machines: as recorded" in found.scope[1]
    assert "runs that were made, but never listed" in found.scope[1]


@pytest.mark.slow
def test_no_code_judges_itself(tmp_path: Path) -> None:
    assert not {name: words for name in CODE if (words := run_code(name, tmp_path)) is not None}
