"""Damaged files are refused in one sentence, or accepted for what they say."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from compare.study.record import read_record
from compare.study.run_study import Study, check_study
from compare.study.settings import FILE, read_manifest, read_settings
from compare.study.store import KEY_DIGITS, Store
from metaheuristics import SearchError
from nlp_gait.backends.identity import hash_json, identify_problem
from nlp_gait.errors import GaitError
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.files import replace_nan
from nlp_gait.formulation import load, load_result
from nlp_gait.proofs.certificate import check_certificate, read_certificate
from nlp_gait.robots import load_robot
from nlp_gait.robots.biped import make_biped_model

SEEDS, CORPUS = (Path(__file__).with_name(name) for name in ("seeds", "corpus"))
KEPT = sorted(path for path in CORPUS.glob("*/*") if path.is_file())
INPUTS, RESULT = {"seed": 1}, {"runs": [{"x": [0.1, 0.2], "status": "converged"}], "best": 0.5}


def read_a_result(path: Path) -> None:
    """All of the file that describes the problem is in the result."""
    result, raw = load_result(path), json.loads(path.read_text())
    assert raw["x"] == result.problem.by_name(result.x)
    assert raw.get("options", {}).items() <= dict(result.problem.options).items()
    assert raw.get("parameters", {}) == dict(result.problem.values)


def read_a_record(path: Path) -> None:
    """Written again, it says what stands in the file."""
    again = replace_nan(read_record(path).to_json())
    raw = json.loads(path.read_text())
    assert {key: again[key] for key in raw if key not in ("verdict", "time_s")} == {
        key: raw[key] for key in raw if key not in ("verdict", "time_s")
    }


def read_a_study(path: Path) -> None:
    check_study(Study(tasks=read_settings(path).tasks()))


def read_a_urdf(path: Path) -> None:
    path.with_suffix(".json").write_bytes((SEEDS / "urdf" / "tiny.json").read_bytes())
    load_robot(str(path))


def read_a_motion(path: Path) -> None:
    angles = read_joint_angles(path, load_robot("nao-v5"))
    assert angles.q.shape == (len(angles.t), len(angles.joints))


def read_a_stored_result(path: Path) -> None:
    """What is damaged is computed again."""
    assert Store(path.parent.parent).compute("one", INPUTS, lambda: RESULT) == RESULT


class Format(NamedTuple):
    """A kind of file: its name when it is read, and a function that reads and checks it."""

    file: str
    read: Callable[[Path], object]


FORMATS = {
    "result": Format("result.json", read_a_result),
    "record": Format("record.json", read_a_record),
    "manifest": Format(FILE, lambda path: read_manifest(path.parent)),
    "study": Format("study.toml", read_a_study),
    "robot": Format("robot.json", lambda path: load_robot(str(path))),
    "urdf": Format("robot.urdf", read_a_urdf),
    "biped": Format("robot.urdf", lambda path: make_biped_model(load_robot(str(path)))),
    "mjcf": Format("robot.xml", lambda path: make_biped_model(load_robot(str(path)))),
    "certificate": Format("certificate.json", lambda path: check_certificate(read_certificate(path), paths=2)),
    "motion": Format("gait.csv", read_a_motion),
    "stored": Format(f"store/one-{hash_json(INPUTS)[:KEY_DIGITS]}.json", read_a_stored_result),
}
of_every_format = pytest.mark.parametrize("name", FORMATS)


def list_seeds(name: str, folder: Path) -> list[bytes]:
    """Return valid examples of a format."""
    suffix = Path(FORMATS[name].file).suffix
    found = [path.read_bytes() for path in sorted((SEEDS / name).iterdir()) if path.suffix == suffix]
    if name == "certificate":  # with the hash that its problem has here: another CasADi writes other formulas
        raw = json.loads(found[0])
        stored = raw["problem"]
        problem = load(stored["name"], **stored["options"]).with_values(**stored["parameters"])
        return [json.dumps({**raw, "problem": identify_problem(problem)}).encode()]
    return found


def prepare(name: str, folder: Path) -> Path:
    """Return where a file of this format is read from."""
    path = folder / FORMATS[name].file
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def end(name: str, path: Path) -> str:
    """Return whether a file is accepted or refused in one sentence; every other error fails the test."""
    try:
        FORMATS[name].read(path)
    except (GaitError, SearchError) as error:
        assert str(error).strip() and "\n" not in str(error)
        return "refused"
    return "accepted"


@of_every_format
def test_valid_files_are_accepted(name: str, tmp_path: Path) -> None:
    path = prepare(name, tmp_path)
    for data in list_seeds(name, tmp_path):
        path.write_bytes(data)
        assert end(name, path) == "accepted"


@pytest.mark.parametrize("kept", KEPT, ids=lambda path: path.relative_to(CORPUS).as_posix())
def test_kept_inputs(kept: Path, tmp_path: Path) -> None:
    """Most once did harm. Their names say what must become of them: ``refused-...`` or ``accepted-...``."""
    path = prepare(kept.parent.name, tmp_path)
    path.write_bytes(kept.read_bytes())
    assert end(kept.parent.name, path) == kept.name.split("-")[0]


def list_places(raw: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the keys that lead to each value of a JSON document."""
    for key, value in raw.items() if isinstance(raw, dict) else enumerate(raw):
        yield (*place, key)
        if isinstance(value, (dict, list)):
            yield from list_places(value, (*place, key))


leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.just("x" * 5000)
values = st.recursive(leaves, lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(), inner, max_size=2))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["result", "record", "manifest", "robot", "stored"])
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_document_of_which_one_value_is_another(name: str, data: st.DataObject, tmp_path: Path) -> None:
    raw = copy.deepcopy(json.loads(data.draw(st.sampled_from(list_seeds(name, tmp_path)))))
    *place, last = data.draw(st.sampled_from(list(list_places(raw))))
    inner = raw
    for key in place:
        inner = inner[key]
    inner[last] = data.draw(values)
    path = prepare(name, tmp_path)
    path.write_text(json.dumps(raw))
    end(name, path)


@of_every_format
@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "loop", "dangling", "empty", "bytes"])
def test_what_is_not_a_file_is_refused_at_once(name: str, kind: str, tmp_path: Path) -> None:
    """A pipe would wait for its writer, and /dev/zero never ends."""
    path = prepare(name, tmp_path)
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("device", "loop", "dangling"):
        path.symlink_to({"device": "/dev/zero", "loop": path.name, "dangling": "nowhere"}[kind])
    else:
        path.write_bytes(b"" if kind == "empty" else bytes(range(256)))
    found = end(name, path)
    assert found == "refused" or name == "stored"  # that is computed again


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "stored"])
def test_a_link_to_a_file_is_read_and_a_huge_one_is_not(name: str, tmp_path: Path) -> None:
    path = prepare(name, tmp_path)
    target = tmp_path / f"target{path.suffix}"
    target.write_bytes(list_seeds(name, tmp_path)[0])
    path.symlink_to(target)
    assert end(name, path) == "accepted"
    with open(target, "r+b") as file:
        file.truncate(2**27)  # without a block on the disk
    assert end(name, path) == "refused"


VERSIONED = {
    "result": (b'"schema": 1', (b'"schema": 0', b'"schema": 2', b'"schema": true', b'"schema": "1"')),
    "record": (b'"schema": 5', (b'"schema": 4', b'"schema": 6', b'"schema": 5.0', b'"scheme": 5')),
    "manifest": (b'"schema": 2', (b'"schema": 1', b'"schema": 3', b'"schema": true', b'"scheme": 2')),
    "study": (b"schema = 1", (b"schema = 0", b"schema = 2", b"schema = true", b'schema = "1"')),
    "robot": (b'"schema": 1', (b'"schema": 0', b'"schema": 2', b'"schema": true', b'"scheme": 1')),
}


@pytest.mark.parametrize("name", VERSIONED)
def test_another_version_is_refused_by_name(name: str, tmp_path: Path) -> None:
    """Results and studies are written by hand, too: without a version they are the first."""
    own, others = VERSIONED[name]
    path, data = prepare(name, tmp_path), next(seed for seed in list_seeds(name, tmp_path) if own in seed)
    for other in others:
        path.write_bytes(data.replace(own, other, 1))
        with pytest.raises(GaitError, match="schem") as error:
            FORMATS[name].read(path)
        assert path.name in str(error.value)
    if name in ("result", "study"):
        path.write_bytes(data.replace(own + b",", b"").replace(own, b""))
        assert end(name, path) == "accepted"
