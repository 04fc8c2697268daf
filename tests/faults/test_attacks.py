"""Attacks of every class with inputs drawn at random: none succeeds. One of each kind is in the default suite, all are slow.

An attack returns None where it is repelled, by one sentence or by no effect, else what it reached.
"""

from __future__ import annotations

import json
import random
import re
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from compare.archive import unpack_archive, verify_folder
from compare.cli import app
from compare.cli.options import parse_number, parse_numbers
from compare.report import write_report
from compare.study import settings
from compare.study.import_runs import import_runs
from compare.study.record import parse_record
from compare.study.record_files import RECORDS, name_run, read_records
from compare.study.run_study import Study, run_study
from compare.study.run_task import try_task
from compare.study.settings import FILE, SolverSpec, StudySettings, read_manifest
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait import load
from nlp_gait.errors import GaitError
from nlp_gait.export.c_files import format_comment
from nlp_gait.robots import load_robot
from tests.compare.archive.forged_archives import change_places, write_zip
from tests.robots.custom import humanoid

Raw = dict[str, Any]
Forgery = Callable[[dict[str, Raw], Raw], object]  # of records by name, and study.json
SEED = 20261127
SETTINGS = StudySettings(
    problems=(ProblemSpec(name="walk12", values={"lambda": 0.4}),),
    solvers=(SolverSpec(name="pso"), SolverSpec(name="ga"), SolverSpec(name="ipopt")),
    runs=3,
    starts=3,
    stop=Stop(evaluations=300),
)


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
    for solver in ("pso", "ga", "ipopt"):
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


def refuse(call: Callable[..., object], *arguments: object, accepted: bool = False) -> str | None:
    """Return None if a call ends by one sentence of ours, or is perhaps accepted; what else happened."""
    try:
        result = call(*arguments)
    except Exception as error:  # other ones are a traceback for a user
        is_sentence = isinstance(error, GaitError) and "\n" not in str(error)
        return None if is_sentence else f"{type(error).__name__}: {error!s:.200}"
    return None if accepted else f"accepted {arguments!r:.200}: {result!r:.80}"


NO_NUMBERS = ("", " ", *"nan inf -inf 1e999 -1e400 NaN Infinity x 1, 0x1p 1e --1 ١٢x".split())


def list_numbers(rng: random.Random) -> Iterator[tuple[str, Callable[[], str | None]]]:
    for text in NO_NUMBERS:
        yield f"number {text!r}", lambda text=text: refuse(parse_number, "n", text, "--n")
        for count in (2, 3, 4):
            words = ["1"] * count
            words[rng.randrange(count)] = text.replace(",", "x")
            yield f"list {words}", lambda words=words: refuse(parse_numbers, "n", ",".join(words), "--n")
    for option in ("--friction", "--mass-factor", "--stiffness-factor", "--bumps-mm"):
        for text in ("nan", "inf", "-inf", "1e999", "1e10"):
            yield f"{option} {text}", lambda o=option, t=text: call_line(o, t)


def call_line(*words: str) -> str | None:
    done = CliRunner().invoke(app, ["simulate", "none.json", *words])
    said = re.search(r"must be a finite number|is not in the range|Input should be", done.output)
    return None if isinstance(done.exception, SystemExit) and said else f"{words}: {done.output[-200:]}"


GARBAGE = (None, -1, float("inf"), 1e300, "", "x", [], {}, [[]], True, "\ud800", 2**70, {"a": {"b": []}}, -1e-300)


def list_places(raw: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key, value in raw.items() if isinstance(raw, dict) else enumerate(raw) if isinstance(raw, list) else ():
        yield (*place, key)
        yield from list_places(value, (*place, key))


def mutate(raw: Any, rng: random.Random) -> Any:
    """Return plain data with garbage at one place."""
    copied = json.loads(json.dumps(raw))
    *above, last = rng.choice(list(list_places(copied)))
    parent = copied
    for key in above:
        parent = parent[key]
    parent[last] = rng.choice([value for value in GARBAGE if value != parent[last]])
    return copied


def list_files(rng: random.Random, folder: Path) -> Iterator[tuple[str, Callable[[], str | None]]]:
    """Yield robots, study files, tables and archives."""
    for name in (":", ":x", "x:", "@", ":@", "a:b:c", "\0", "a\nb", "." * 300, "package://x", "//", "~"):
        yield f"robot {name!r}", lambda name=name: refuse(load_robot, name)
    for ending, head in (("urdf", '<robot name="r">'), ("xml", "<mujoco>")):
        path = folder / f"many.{ending}"
        path.write_text(head + '<mesh file="x.obj"/>' * 50_000)
        yield f"many meshes in {ending}", lambda path=path: refuse(load_robot, str(path))
    for k in range(90):
        path = folder / f"robot{k}.json"
        path.write_text(json.dumps(mutate(humanoid(), rng)))
        yield f"robot file {k}", lambda path=path: refuse(load_robot, str(path), accepted=True)
    for _ in range(90):
        raw = mutate(SETTINGS.to_json(), rng)
        yield f"study {raw}", lambda raw=raw: refuse(settings.parse_settings, raw, "study", accepted=True)
    variables = load("walk12").names
    for k in range(60):
        cells = [["0.1"] * len(variables) for _ in range(3)]
        cells[rng.randrange(3)][rng.randrange(len(variables))] = rng.choice([n for n in NO_NUMBERS if n.strip()])
        path = folder / f"table{k}.csv"
        path.write_text("\n".join(",".join(row) for row in [list(variables), *cells]))
        yield f"table {cells}", lambda path=path: refuse(import_runs, ProblemSpec(name="walk12"), path, "ga")
    for k in range(60):
        path, depth = folder / f"archive{k}.zip", rng.randrange(70, 2000)
        bad = rng.choice(["../" * depth, "a/" * depth, "/", "\0", "a//", "c:", "e\\", "\x1b[2J", "g/./"]) + "x"
        whole = write_zip({bad: b"x"} if k % 12 else {f"f{i}": b"" for i in range(10_001 + k)})
        path.write_bytes(whole[: rng.randrange(len(whole))] if k % 5 == 4 else whole)
        yield f"archive {bad[:20]!r}", lambda path=path, k=k: refuse(unpack_archive, path, folder / f"unpacked{k}")
    for _ in range(40):
        text = "".join(rng.choice(["*/", "*", "/", "a", "\\", "\n", "??/"]) for _ in range(8)) + "*/"
        yield f"comment {text!r}", lambda text=text: "closed" if "*/" in format_comment([text]) else None


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


def test_the_honest_study_holds_and_says_what_was_not_checked(honest: Path) -> None:
    found = verify_folder(honest)
    assert all(finding.holds for finding in found.findings), [f.sentence for f in found.findings]
    assert "evaluated: 9 points; repeated: " in found.scope[0] and "times and machines: as recorded" in found.scope[1]
    assert "runs that were made, but never listed" in found.scope[1]


@pytest.mark.parametrize("every", [10, pytest.param(1, marks=pytest.mark.slow)])
def test_no_number_file_or_text_gets_through(every: int, tmp_path: Path) -> None:
    attacks = [*list_numbers(rng := random.Random(SEED)), *list_files(rng, tmp_path)]
    reached = {name: words for name, attack in attacks[::every] if (words := attack()) is not None}
    assert not reached and len(attacks) >= 400


@pytest.mark.slow
def test_no_code_judges_itself(tmp_path: Path) -> None:
    assert not {name: words for name in CODE if (words := run_code(name, tmp_path)) is not None}
