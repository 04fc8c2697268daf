"""No forged record influences a report: each is excluded by name, and the numbers are those of the honest records."""

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from compare.study.evidence import CheckedRecords, Scope, read_evidence
from compare.study.record import parse_record
from compare.study.record_files import RECORDS, read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import KEY_DIGITS, ProblemSpec, Stop
from nlp_gait.errors import GaitError
from tests.compare.archive.forged_archives import change_places

Raw = dict[str, Any]
Records = dict[str, Raw]  # plain records by the name of their file, such as pso-0001
Change = tuple[str, Any]  # keys separated by dots; a function of the present value, or a value

STUDY = StudySettings(
    problems=(ProblemSpec(name="walk12", values={"lambda": 0.4}),),
    solvers=(SolverSpec(name="pso"), SolverSpec(name="ipopt")),
    runs=3,
    starts=3,
    stop=Stop(evaluations=400),
)
BOUND = 0.96  # better than what is proven of walk12 at lambda = 0.4: 0.9222


def replace_first(value: Any) -> Callable[[Raw], Raw]:
    return lambda old: {**old, next(iter(old)): value}


def drop_first(old: Raw) -> Raw:
    return dict(list(old.items())[1:])


def set_everywhere(value: float) -> tuple[Change, ...]:
    """Change the objective in each place where a careful forger finds it."""

    def replace_f(indexes: Raw | None) -> Raw | None:
        return indexes and {name: value if name == "f" else old for name, old in indexes.items()}

    return (
        *((f"{key}", value) for key in ("verdict.objective", "claimed_objective", "history.objective.-1")),
        ("verdict.indexes", replace_f),
        ("verdict.dense", replace_f),
    )


def other_probe(value: float) -> float:
    return value * (1 + 1e-8)


PROBLEM = "inputs.problem."
OF_ANY_SOLVER: dict[str, tuple[Change, ...]] = {
    **{
        f"objective times {k}": (("verdict.objective", lambda v, k=k: v * k),)  # type: ignore[misc]
        for k in (1.6, 1.01, 1 + 1e-7)
    },
    "no objective": (("verdict.objective", None),),
    "a better value everywhere": set_everywhere(0.9221),
    "better than the bound everywhere": set_everywhere(BOUND),
    "infeasible": (("verdict.feasible", False),),
    "a violation": (("verdict.violation", 0.01),),
    "an index": (("verdict.indexes", replace_first(0.5)),),
    "an index less": (("verdict.indexes", drop_first),),
    "another point": (("x", lambda x: {**x, list(x)[1]: x[list(x)[1]] - 1e-5}),),
    "a point of three variables": (("x", drop_first),),
    "a variable of another name": (("x", lambda x: {**drop_first(x), "speed": 1.0}),),
    "no point": (("x", {}),),
    "a coordinate that is no number": (("x", replace_first(None)),),
    "another weight": ((PROBLEM + "parameters", {"lambda": 0.1}),),
    "another probe": ((PROBLEM + "probes.1.objective", other_probe),),
    "no probes": ((PROBLEM + "probes", []),),
    "formulas of another version": ((PROBLEM + "mathematics", 2),),
    "another problem": ((PROBLEM + "name", "nao-ssp"),),
    "code of the forger": ((PROBLEM + "name", "forger.py:walk"),),
    "the other sense": (("inputs.objective.sense", "minimise"),),
    "a schema of the future": (("schema", 9),),
    "an unknown key": (("verdikt", True),),
    "fewer evaluations": (("evaluations.f", lambda f: f - 1),),
}
OF_A_SEARCH: dict[str, tuple[Change, ...]] = {
    "a history that ends better": (("history.objective.-1", BOUND),),
    "a history that ends worse": (("history.objective.-1", 0.1),),
    "an infinite history": (("history.objective.0", 1e999),),
    "a history of fewer evaluations": (("history.evaluations.-1", lambda v: v - 1),),
    "a history of other length": (("history.evaluations", lambda v: v[:-1]),),
    "evaluations that descend": (("history.evaluations.1", 1),),
    "a budget that was exceeded": (("inputs.stop.evaluations", 100),),
    "other settings": (("settings.population", 7),),
    "no origin": (("origin", None),),
    "other code": (("inputs.code", "f" * 64),),
    "another CasADi and probe": (("origin.casadi", "1.0"), (PROBLEM + "probes.0.objective", other_probe)),
}
BETWEEN_SAMPLES: dict[str, tuple[Change, ...]] = {  # noticed by a complete verification only
    "a dense grid that fails": (("verdict.dense_feasible", lambda v: not v),),
    "no dense grid": (("verdict.dense", None), ("verdict.dense_feasible", None)),
    "another index on the dense grid": (("verdict.dense", replace_first(0.5)),),
    "no guarantee": (("verdict.guaranteed", None),),
    "a guarantee withdrawn": (("verdict.guaranteed.satisfied", lambda v: not v),),
}
COPIES: dict[str, tuple[str, tuple[Change, ...]]] = {  # file of a copy of pso-0001, and what is changed in it
    "a copy with its seed": ("pso-0007", (("run", 7),)),
    "a copy under another file name": ("pso-0009", ()),
}


def list_forgeries() -> Iterator[Any]:
    """Yield the file that a forgery changes or adds, its changes, and what finds it."""
    for victim in ("pso-0001", "ipopt-0001"):
        for name, changes in OF_ANY_SOLVER.items():
            yield pytest.param(victim, changes, "best", id=f"{victim}: {name}")
    for scope, table in (("best", OF_A_SEARCH), ("all", BETWEEN_SAMPLES)):
        for name, changes in table.items():
            yield pytest.param("pso-0001", changes, scope, id=name)
    for name, (victim, changes) in COPIES.items():
        yield pytest.param(victim, changes, "best", id=name)


def forge(records: Records, victim: str, changes: tuple[Change, ...]) -> Records:
    forged = copy.deepcopy(records)
    change_places(forged.setdefault(victim, copy.deepcopy(records["pso-0001"])), changes)
    return forged


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Records:
    """The plain records of an honest study."""
    folder = tmp_path_factory.mktemp("study")
    run_study(Study(tasks=STUDY.tasks(), folder=folder))
    assert read_evidence(folder, "all").excluded == []
    return {path.stem[: -KEY_DIGITS - 1]: json.loads(path.read_text()) for path in folder.glob(f"{RECORDS}/*/*.json")}


def find_key(raw: Raw) -> str:
    """Return the key with which a careful forger names the file."""
    try:
        return parse_record({**raw, "status": ""}).inputs.key
    except (GaitError, ValueError):
        return "0" * KEY_DIGITS


def read_files(records: Records, folder: Path, scope: Scope = "best") -> CheckedRecords:
    (folder / RECORDS / "walk12").mkdir(parents=True)
    for name, raw in records.items():
        (folder / RECORDS / "walk12" / f"{name}-{find_key(raw)}.json").write_text(json.dumps(raw))
    return read_evidence(folder, scope)


@pytest.mark.parametrize(("victim", "changes", "scope"), list(list_forgeries()))
def test_a_forged_record_is_named_and_without_influence(
    victim: str, changes: tuple[Change, ...], scope: Scope, honest: Records, tmp_path: Path
) -> None:
    kept, excluded = read_files(forge(honest, victim, changes), tmp_path, scope)
    sentences = [exclusion.sentence for exclusion in excluded]
    solver, run = victim.split("-")
    names = (f"walk12, {solver}, run {int(run)}:", f"{RECORDS}/walk12/{victim}-")
    assert len(sentences) == 1 and sentences[0].startswith(names), sentences
    assert [record.to_json() for record in kept] == [raw for name, raw in sorted(honest.items()) if name != victim]


@pytest.mark.parametrize(
    "change", [("inputs.seed", 99), ("inputs.stop.evaluations", 399), ("solver", "mine"), ("run", 2)]
)
def test_a_record_whose_inputs_do_not_fit_the_name_of_its_file_is_named(
    change: Change, honest: Records, tmp_path: Path
) -> None:
    folder = tmp_path / RECORDS / "walk12"
    folder.mkdir(parents=True)
    for name, raw in forge(honest, "pso-0001", (change,)).items():
        (folder / f"{name}-{find_key(honest[name])}.json").write_text(json.dumps(raw))
    (excluded,) = read_evidence(tmp_path).excluded
    assert excluded.name.startswith(f"{RECORDS}/walk12/pso-0001-") and "belongs to walk12/" in excluded.sentence


def test_a_forged_record_is_computed_again_when_the_study_continues(honest: Records, tmp_path: Path) -> None:
    forged = forge(honest, "pso-0001", (("verdict.objective", 0.99),))
    read_files(forge(forged, "pso-0002", (("origin.casadi", "1.0"),)), tmp_path)
    said: list[str] = []
    run_study(Study(tasks=STUDY.tasks(), folder=tmp_path), on_outdated=said.append)
    assert len(said) == 2 and "its objective is 0.99" in said[0] and "other code" in said[1]
    again = {(r.solver, r.run): r.verdict.objective for r in read_records(tmp_path)}
    assert again["pso", 1] == honest["pso-0001"]["verdict"]["objective"]
