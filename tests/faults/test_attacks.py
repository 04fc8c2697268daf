"""Studies that are consistent in themselves but were not computed so are not called whole, and no user code judges itself."""

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.study.record import parse_record
from compare.study.run import ProblemSpec, Run, Stop
from compare.study.settings import SolverSpec, StudySettings
from compare.study.study import FILE, RECORDS, Study, name_record, run_study, write_command
from compare.study.verify import verify_study
from nlp_gait import load
from tests.compare.records import run_once

Raw = dict[str, Any]
Forgery = Callable[[list[Raw], Raw], object]  # of records, and the settings in study.json
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
    write_command(folder, SETTINGS, "nlp-gait compare walk12")
    run_study(Study(runs=SETTINGS.make_runs(), folder=folder, jobs=2))
    return folder


def edit(solver: str, change: Callable[[Raw], object]) -> Forgery:
    return lambda records, _: [change(raw) for raw in records if raw["solver"] == solver]


def set_all(solver: str, path: str, value: Any) -> Forgery:
    """Return the forgery that sets a field, such as ``inputs.seed``, in all records of a solver."""
    *folders, name = path.split(".")

    def change(raw: Raw) -> None:
        for folder in folders:
            raw = raw[folder]
        raw[name] = value(raw[name]) if callable(value) else value

    return edit(solver, change)


def copy_runs(source: str, *fields: str) -> Forgery:
    """Return the forgery that gives PSO the points of another solver, and further fields."""
    judged = ("x", "objective", "violation", "feasible", "metrics", "reported_objective", "history")

    def forge(records: list[Raw], _: Raw) -> None:
        donors, takers = ([raw for raw in records if raw["solver"] == name] for name in (source, "pso"))
        for donor, taker in zip(donors, takers, strict=True):
            taker.update({name: donor[name] for name in (*judged, "time_s", *fields)})

    return forge


def drop(solver: str, number: int, *, renumber: bool = False) -> Forgery:
    """Return the forgery that deletes a run, and perhaps gives the later ones the numbers before theirs."""

    def forge(records: list[Raw], _: Raw) -> None:
        records[:] = [raw for raw in records if (raw["solver"], raw["run"]) != (solver, number)]
        for raw in records if renumber else ():
            raw["run"] -= raw["solver"] == solver and raw["run"] > number

    return forge


def list_forgeries() -> Iterator[tuple[str, Forgery]]:
    """Yield forgeries, after which the files have the names of their content."""
    for source in ("ipopt", "ga"):
        yield f"points of {source}", copy_runs(source)
        yield f"all but inputs of {source}", copy_runs(source, "status", "counts", "iterations", "settings")
    for solver in ("pso", "ipopt"):
        yield f"counts of {solver}", set_all(solver, "counts.f", lambda count: count // 2)
        yield f"iterations of {solver}", set_all(solver, "iterations", 1)
        yield f"status of {solver}", set_all(solver, "status", "target reached")
        yield f"seeds of {solver}", set_all(solver, "inputs.seed", lambda seed: seed + 40)
        yield f"a setting of {solver}", set_all(solver, "settings.kind", "Other")
        yield f"failures of {solver}", set_all(solver, "failed_evaluations", lambda number: number + 1)
        yield f"run 1 of {solver} deleted", drop(solver, 1)
        yield f"run 1 of {solver} picked", drop(solver, 1, renumber=True)
        yield f"the name of {solver}", set_all(solver, "solver", "mine")
    yield (
        "prices",
        set_all("ipopt", "active_constraints", lambda active: [{**a, "price": 2 * a["price"]} for a in active]),
    )
    yield "a price less", set_all("ipopt", "active_constraints", lambda active: active[1:])
    yield "history", set_all("pso", "history.objective", lambda values: [values[-1]] * len(values))
    yield "budgets", set_all("pso", "inputs.stop", lambda stop: {**stop, "evaluations": 150})


FORGERIES = dict(list_forgeries())


@pytest.mark.slow
@pytest.mark.parametrize("name", FORGERIES)
def test_no_consistent_forgery_is_called_whole(name: str, honest: Path, tmp_path: Path) -> None:
    study = json.loads((honest / FILE).read_text())
    records = [json.loads(path.read_text()) for path in sorted((honest / RECORDS).glob("*/*.json"))]
    FORGERIES[name](records, study["study"])
    study["runs"] = [name_record(parse_record(raw)) for raw in records]
    shutil.copytree(honest, tmp_path / "study", ignore=shutil.ignore_patterns(RECORDS))
    (tmp_path / "study" / RECORDS / "walk12").mkdir(parents=True)
    for place, raw in zip(study["runs"], records, strict=True):
        (tmp_path / "study" / RECORDS / f"{place}.json").write_text(json.dumps(raw))
    (tmp_path / "study" / FILE).write_text(json.dumps(study))
    assert not verify_study(tmp_path / "study").holds


CODE = {
    "points that are truth values": "f(lower > 0)",
    "more than its budget": "[f(lower) for _ in range(10**5)]",
    "a judge of its own": "f(lower)\n    import compare.study.perform as r\n    r.evaluate = lambda p, x: None",
    "values of its own": "f(lower)\n    import gc\n    for o in gc.get_objects():\n"
    "        if type(o).__name__ == 'Evaluator': o.best, o.evaluations, o.best_x = (0.0, -9.0), 1, lower",
    "a channel of its own": "import os\n    [os.write(int(d), b'x') for d in os.listdir('/proc/self/fd') if int(d) > 2]",
    "another record": "import compare.study.record as r\n    f(lower)\n    r.RunRecord.to_json = lambda s: {'schema': 5}",
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CODE)
def test_no_code_judges_itself(name: str, tmp_path: Path) -> None:
    """What is recorded is evaluated and counted by this process, or the run has failed."""
    path = tmp_path / f"{re.sub('[^a-z]', '_', name)}.py"
    path.write_text(f"def search(f, lower, upper, evaluations, seed):\n    {CODE[name]}\n")
    record = run_once(Run(problem=ProblemSpec(name="walk12"), solver=f"{path}:search", stop=Stop(evaluations=20)))
    if not record.x:
        assert record.status.startswith("failed: ")
        return
    assert record.counts == {"f": 20 if name == "more than its budget" else 1}
    np.testing.assert_array_equal(list(record.x.values()), load("walk12").lower)
