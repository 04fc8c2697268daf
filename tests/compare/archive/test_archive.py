"""An archive holds on any machine, its runs can be repeated, and every damage and forgery is named."""

import json
import re
import zipfile
from pathlib import Path

import pytest

from compare.archive import Finding, pack_study, unpack_archive, verify_folder
from compare.archive.pack import _collect_robot, write_archive
from compare.archive.verify import _check_code_files
from compare.study.evidence import read_evidence
from compare.study.record_files import read_records
from compare.study.run_study import Study, run_study
from compare.study.settings import Session, SolverSpec, StudySettings, write_manifest
from compare.study.task import ProblemSpec, Stop
from nlp_gait.errors import InputError, UserCodeError
from nlp_gait.proofs.certificate import load_certificates
from nlp_gait.user_code import allow_code
from tests.compare.archive.forged_archives import Files, damage, forge, sign, write_zip
from tests.compare.cli.calls import as_json, nlp_gait, one_sentence
from tests.robots.crooked import crooked, crooked_urdf
from tests.robots.test_mjcf import plain_urdf


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of a certified problem."""
    out = tmp_path_factory.mktemp("study")
    stored = load_certificates()["walk12-lambda-0.4"].problem
    spec = ProblemSpec(name=stored["name"], options=stored["options"], values=stored["parameters"], label="walk")
    solvers = (SolverSpec(name="pso", polish=True), SolverSpec(name="ipopt"))
    settings = StudySettings(problems=(spec,), solvers=solvers, runs=2, starts=1, stop=Stop(evaluations=200))
    write_manifest(out, settings, Session.begin("nlp-gait compare walk12", "1"))
    run_study(Study(tasks=settings.tasks(), folder=out))
    return out


@pytest.fixture(scope="module")
def files(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Files:
    """The files of its archive, without a report."""
    archive = pack_study(folder, read_evidence(folder).records, tmp_path_factory.mktemp("archive") / "study.zip")
    with zipfile.ZipFile(archive) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def find_record(files: Files) -> str:
    (name,) = (name for name in files if name.startswith("records/walk/pso-0001-"))
    return name


def verify(content: bytes, folder: Path, **options: object) -> list[Finding]:
    folder.mkdir()
    path = folder / "study.zip"
    path.write_bytes(content)
    try:
        manifest, differences = unpack_archive(path, folder / "unpacked")
    except InputError as error:
        return [Finding("archive", False, str(error))]
    found = verify_folder(folder / "unpacked", robots=manifest.robots, **options).findings  # type: ignore[arg-type]
    return [Finding("manifest", not differences, "; ".join(differences)), *found]


@pytest.mark.slow
def test_an_archive_has_everything_and_every_run_can_be_repeated(files: Files, tmp_path: Path) -> None:
    expected = {"README.md", "requirements.txt", "manifest.json", "study.json", find_record(files)}
    assert expected | {"certificates/walk12-lambda-0.4.json"} <= files.keys()
    findings = verify(write_zip(files), tmp_path / "a", share=1.0)
    assert [f.sentence for f in findings if f.holds is False] == []
    assert findings[-1].sentence == "repeated runs: holds: 5 have the same results, to the last bit"


@pytest.mark.slow
def test_every_damage_is_named(files: Files, tmp_path: Path) -> None:
    for k, (name, content, word) in enumerate(damage(files, find_record(files))):
        wrong = [finding.detail for finding in verify(content, tmp_path / str(k)) if finding.holds is False]
        assert wrong and word in wrong[0], (name, wrong)
    assert not list(tmp_path.rglob("outside*")) and not (tmp_path.parent / "outside.txt").exists()


@pytest.mark.slow
def test_every_forgery_with_a_fitting_manifest_is_named(files: Files, tmp_path: Path) -> None:
    for k, (name, content, word) in enumerate(forge(files, find_record(files))):
        wrong = [finding.sentence for finding in verify(content, tmp_path / str(k)) if finding.holds is False]
        assert len(wrong) == 1 and word in wrong[0], (name, wrong)


TETRAHEDRON = "v -0.05 -0.05 0\nv 0.15 0 0\nv -0.05 0.05 0\nv 0 0 0.05\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


def pack_robot(robot: str, folder: Path) -> set[str]:
    """Pack a robot alone, which loads and compares the copy; return the archived files."""
    content: dict[str, bytes] = {}
    folder.mkdir()
    write_archive(folder / "robot.zip", content, {robot: _collect_robot(robot, content)})
    return {name.split("/", 2)[2] for name in content if name.startswith("robots/")}


def test_meshes_and_extended_files_travel_with_a_urdf(tmp_path: Path) -> None:
    pytest.importorskip("lxml")
    package = tmp_path / "legs"
    for folder in (package / "urdf", package / "meshes", package / "variants"):
        folder.mkdir(parents=True)
    (package / "meshes" / "sole.obj").write_text(TETRAHEDRON)
    mesh = '<geometry><mesh filename="package://legs/meshes/sole.obj"/></geometry>'
    text = re.sub(r"<geometry><box.*?</geometry>", mesh, crooked_urdf())
    (package / "urdf" / "base.urdf").write_text(text)
    heavy = {"schema": 1, "name": "heavy", "extends": "../urdf/base.urdf"}
    (package / "variants" / "heavy.json").write_text(json.dumps(heavy))
    packed = pack_robot(f"{package}/variants/heavy.json@base.mass=1.1", tmp_path / "packed")
    assert packed == {"legs/variants/heavy.json", "legs/urdf/base.urdf", "legs/meshes/sole.obj"}
    absolute = {**heavy, "extends": str(package / "urdf" / "base.urdf")}
    (package / "variants" / "far.json").write_text(json.dumps(absolute))
    with pytest.raises(InputError, match=r"far\.json' cannot be archived: its copy needs '.*sole\.obj'; name extended"):
        pack_robot(f"{package}/variants/far.json", tmp_path / "far")


def test_included_files_and_meshes_travel_with_an_mjcf(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    pytest.importorskip("lxml")
    home = tmp_path / "home"
    (home / "meshes").mkdir(parents=True)
    (home / "meshes" / "sole.obj").write_text(TETRAHEDRON)
    model = mujoco.MjModel.from_xml_path(crooked(tmp_path, plain_urdf()))
    mujoco.mj_saveLastXML(str(home / "crooked.xml"), model)
    text, asset = (home / "crooked.xml").read_text(), '<asset><mesh name="sole" file="sole.obj"/></asset>'
    (home / "parts.xml").write_text(f"<mujocoinclude>{asset}</mujocoinclude>")
    text = text.replace("<worldbody>", '<include file="parts.xml"/><worldbody>')
    text = text.replace("<compiler ", '<compiler meshdir="meshes" ')
    text, count = re.subn(
        r'<geom size="[^"]*" pos="([^"]*)" type="box"', r'<geom type="mesh" mesh="sole" pos="\1"', text
    )
    assert count == 2
    (home / "crooked.xml").write_text(text)
    packed = pack_robot(str(home / "crooked.xml"), tmp_path / "packed")
    assert packed == {"home/crooked.xml", "home/parts.xml", "home/meshes/sole.obj"}


@pytest.mark.slow
def test_the_commands_and_a_forged_report(folder: Path, tmp_path: Path, coarse_pictures: None) -> None:
    nlp_gait("verify", folder, "--pack", tmp_path / "study.zip")
    assert as_json("verify", tmp_path / "study.zip", "--rerun", "5%")["holds"]
    with zipfile.ZipFile(tmp_path / "study.zip") as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    content["report.md"] = content["report.md"].replace(b"On walk the best f is 0.9", b"On walk the best f is 1.9", 1)
    (tmp_path / "forged.zip").write_bytes(write_zip(sign(content)))
    assert "texts: DOES NOT HOLD: line" in nlp_gait("verify", tmp_path / "forged.zip", status=1).stdout
    refused = one_sentence("verify", tmp_path / "forged.zip", "--rerun", "most")
    assert "--rerun: the share must be a finite number" in refused


@pytest.mark.slow
def test_user_code_and_robots_travel_with_the_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_compiler: None
) -> None:
    from tests.robots.custom import humanoid

    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir(home)
    (tmp_path / "base.json").write_text(json.dumps(humanoid()))
    (home / "my.json").write_text(json.dumps({"schema": 1, "name": "mine", "extends": "../base.json"}))
    (home / "mine.py").write_text(
        "import helper\n\n\ndef search(f, lower, upper, evaluations, seed):\n    f(helper.middle(lower, upper)[None])\n"
    )
    (home / "helper.py").write_text("def middle(a, b):\n    return 0.5 * (a + b)\n")
    spec = ProblemSpec(name="nao-ssp", options={"robot": "my.json"})
    solver = SolverSpec(name="mine.py:search")
    settings = StudySettings(problems=(spec,), solvers=(solver,), runs=1, stop=Stop(evaluations=20))
    (home / "out").mkdir()
    write_manifest(home / "out", settings, Session.begin("nlp-gait compare", "1"))
    run_study(Study(tasks=settings.tasks(), folder=home / "out"))
    with pytest.raises(UserCodeError, match="add --code mine.py:search"):
        pack_study(home / "out", read_evidence(home / "out").records, tmp_path / "study.zip")
    allow_code("mine.py:search", "algorithm")
    archive = pack_study(home / "out", read_evidence(home / "out").records, tmp_path / "study.zip")
    away = tmp_path / "away"
    away.mkdir()
    (tmp_path / "base.json").unlink()
    monkeypatch.chdir(away)
    manifest, differences = unpack_archive(archive, away / "unpacked")
    assert {p.name for p in (away / "unpacked" / "code").iterdir()} == {"mine.py", "helper.py"} and not differences
    found = verify_folder(away / "unpacked", robots=manifest.robots)
    assert [f.sentence for f in found.findings if f.holds is False] == []
    assert "evaluations that user code makes by loading the problem itself" in found.scope[1]
    (away / "unpacked" / "code" / "helper.py").write_text("def middle(a, b):\n    return a\n")
    assert [f.holds for f in _check_code_files(away / "unpacked", read_records(away / "unpacked"))] == [False]
