"""Damaged files and command lines, most of which once did harm, are refused in one sentence, or accepted for what they say."""

import json
import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.study.memo import KEY_DIGITS, Memo
from compare.study.record import read_record
from compare.study.study import FILE, read_study_file
from metaheuristics import SearchError
from nlp_gait import __version__
from nlp_gait.backends.exact import hash_json
from nlp_gait.errors import GaitError
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.files import replace_nan
from nlp_gait.formulation import load_result
from nlp_gait.proofs.certificate import read_certificate
from nlp_gait.robots import load_robot
from nlp_gait.robots.biped import make_biped_model
from tests.compare.records import DSP_X

SEEDS, CORPUS = (Path(__file__).with_name(name) for name in ("seeds", "corpus"))
LINES = json.loads((CORPUS / "command_lines.json").read_text(encoding="utf-8"))
INPUTS, RESULT = {"seed": 1}, {"runs": [{"x": [0.1, 0.2], "status": "converged"}], "best": 0.5}
SCHEMA = re.compile(rb'("?schema"? ?[:=] ?)\d+(,?)')


def read_a_result(path: Path) -> None:
    """All of the file that describes the problem is in the result."""
    result, raw = load_result(path), json.loads(path.read_text())
    stored = raw["definition"]["problem"] if "definition" in raw else raw
    assert raw["x"] == result.problem.by_name(result.x)
    assert stored.get("options", {}).items() <= dict(result.problem.options).items()
    assert stored.get("parameters", {}) == dict(result.problem.values)


def read_a_record(path: Path) -> None:
    """Written again, it says what stands in the file."""
    again, raw = replace_nan(read_record(path).to_json()), json.loads(path.read_text())
    assert all(again[key] == raw[key] for key in raw if key != "time_s")


def read_a_study(path: Path) -> None:
    read_study_file(path.parent)


def read_a_urdf(path: Path) -> None:
    path.with_suffix(".json").write_bytes((SEEDS / "urdf" / "tiny.json").read_bytes())
    load_robot(str(path))


def read_a_motion(path: Path) -> None:
    angles = read_joint_angles(path, load_robot("nao-v5"))
    assert angles.q.shape == (len(angles.t), len(angles.joints))


def read_a_stored_result(path: Path) -> None:
    """What is damaged is computed again."""
    assert Memo(path.parent.parent).compute("one", INPUTS, lambda: RESULT) == RESULT


# A kind of file: its name when it is read, and a function that reads and checks it.
FORMATS = {
    "result": ("result.json", read_a_result),
    "record": ("record.json", read_a_record),
    "manifest": (FILE, read_a_study),
    "robot": ("robot.json", lambda path: load_robot(str(path))),
    "urdf": ("robot.urdf", read_a_urdf),
    "biped": ("robot.urdf", lambda path: make_biped_model(load_robot(str(path)))),
    "mjcf": ("robot.xml", lambda path: make_biped_model(load_robot(str(path)))),
    "certificate": ("certificate.json", read_certificate),
    "motion": ("gait.csv", read_a_motion),
    "stored": (f"store/one-{hash_json({'version': __version__, **INPUTS})[:KEY_DIGITS]}.json", read_a_stored_result),
}
of_every_format = pytest.mark.parametrize("name", FORMATS)


def list_seeds(name: str) -> list[bytes]:
    """Return valid examples of a format."""
    suffix = Path(FORMATS[name][0]).suffix
    return [path.read_bytes() for path in sorted((SEEDS / name).iterdir()) if path.suffix == suffix]


def prepare(name: str, folder: Path) -> Path:
    """Return where a file of this format is read from."""
    path = folder / FORMATS[name][0]
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def judge(name: str, path: Path) -> str:
    """Return whether a file is accepted, or the one sentence that refuses it; every other error fails the test."""
    try:
        FORMATS[name][1](path)
    except (GaitError, SearchError) as error:
        assert str(error).strip() and "\n" not in str(error)
        return f"refused: {error}"
    return "accepted"


@pytest.mark.parametrize(
    "path", [path for path in sorted(CORPUS.glob("*/*"))], ids=lambda path: f"{path.parent.name}/{path.name}"
)
def test_the_name_of_a_damaged_file_says_what_becomes_of_it(path: Path, tmp_path: Path) -> None:
    copied = prepare(path.parent.name, tmp_path)
    copied.write_bytes(path.read_bytes())
    assert judge(path.parent.name, copied).partition(":")[0] == path.name.partition("-")[0]


@of_every_format
def test_valid_files_are_accepted_and_other_versions_are_not(name: str, tmp_path: Path) -> None:
    """Results are written by hand, too: without a version they are the first."""
    path = prepare(name, tmp_path)
    for data in list_seeds(name):
        path.write_bytes(data)
        assert judge(name, path) == "accepted"
        if name == "stored" or not SCHEMA.search(data):
            continue
        for other in (b"0", b"99", b"true", b'"1"', b"1.0"):
            path.write_bytes(SCHEMA.sub(rb"\g<1>" + other + rb"\g<2>", data, count=1))
            assert re.fullmatch(f"refused: .*{re.escape(path.name)}.*schem.*", judge(name, path))
        path.write_bytes(data.replace(b"schema", b"scheme", 1))
        assert judge(name, path).startswith("refused")
        path.write_bytes(SCHEMA.sub(b"", data, count=1))
        assert judge(name, path) == "accepted" or name != "result"


REASONS = {
    "pipe": "it is not a regular file",
    "device": "it is not a regular file",
    "huge": "it has more than",
    **dict.fromkeys(("folder", "loop", "dangling", "empty", "bytes"), ""),
}


@of_every_format
@pytest.mark.parametrize("kind", REASONS)
def test_what_is_not_such_a_file_is_refused_at_once(name: str, kind: str, tmp_path: Path) -> None:
    """A pipe would wait for its writer, and /dev/zero never ends; a link to a file is read."""
    path = prepare(name, tmp_path)
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("device", "loop", "dangling"):
        path.symlink_to({"device": "/dev/zero", "loop": path.name, "dangling": "nowhere"}[kind])
    elif kind == "huge":
        target = tmp_path / f"target{path.suffix}"
        target.write_bytes(list_seeds(name)[0])
        path.symlink_to(target)
        assert judge(name, path) == "accepted"
        os.truncate(target, 2**27)  # without a block on the disk
    else:
        path.write_bytes(b"" if kind == "empty" else bytes(range(256)))
    verdict = judge(name, path)
    assert (verdict.startswith("refused") and REASONS[kind] in verdict) or name == "stored"  # that is computed again


@pytest.mark.parametrize("line", LINES, ids=lambda line: " ".join(line)[:60].encode("ascii", "replace").decode())
def test_command_lines_that_once_did_harm(line: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A traceback, a hang, or an answer to another question."""
    monkeypatch.chdir(tmp_path)
    Path("result.json").write_bytes((SEEDS / "result" / "by-hand.json").read_bytes())
    Path("step.json").write_text(json.dumps({"problem": "nao-dsp", "x": DSP_X}))
    os.mkfifo("pipe.json")
    done = CliRunner().invoke(app, line)
    assert done.exit_code in (1, 2) and isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == 2 or done.stderr.splitlines()[-1].startswith("nlp-gait: ")
