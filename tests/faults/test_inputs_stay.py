"""No command writes over a file that it reads, nor over a file of another program in an exported folder."""

from __future__ import annotations

import json
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from nlp_gait import gaitbench
from nlp_gait.errors import OutputError
from nlp_gait.files import protect_inputs, write_text
from nlp_gait.gaitbench.c_export import export_objective
from tests.robots.custom import humanoid

RUN = CliRunner()
EXAMPLE = Path(__file__).parents[2] / "examples" / "bring_your_own.py"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a robot, a source file, points and a result."""
    monkeypatch.chdir(tmp_path)
    Path("my.json").write_text(json.dumps(humanoid()))
    shutil.copy(EXAMPLE, "byo.py")
    names = RUN.invoke(app, ["list", "walk12", "--json"])
    variables = [variable["name"] for variable in json.loads(names.stdout)["variables"]]
    Path("p.csv").write_text(",".join(variables) + "\n" + ",".join(["0.1"] * len(variables)) + "\n")
    Path("w.json").write_text(json.dumps({"problem": "walk12", "x": dict.fromkeys(variables, 0.1)}))
    Path("link.json").symlink_to("my.json")
    return tmp_path


CALLS = [
    ("solve nao-dsp --robot my.json --starts 1 --out my.json", "my.json"),
    ("solve nao-dsp --robot link.json --starts 1 --out my.json", "my.json"),
    ("solve nao-dsp --set robot=my.json --starts 1 --out ./my.json", "my.json"),
    ("list --robot my.json --out my.json", "my.json"),
    ("solve byo.py:two_link --starts 1 --out byo.py", "byo.py"),
    ("evaluate walk12 --x p.csv --csv p.csv", "p.csv"),
    ("evaluate walk12 --x p.csv --csv ../{name}/p.csv", "p.csv"),
    ("export w.json --to json --out w.json", "w.json"),
]
# Written files, before and after a change, for commands that write one.
WRITERS = [
    ("evaluate walk12 --x p.csv --csv {file}", ".csv"),
    ("export w.json --to json --out {file}", ".json"),
    ("solve byo.py:two_link --starts 1 --out {file}", ".json"),
    ("export w.json --to csv --out {file}", ".csv"),
    ("export w.json --to html --out {file}", ".html"),
    ("export w.json --to gif --out {file}", ".gif"),
    ("evaluate walk12 --x 0.1,0.1,0.1,0.1 --signals {file}", ".npz"),
    ("list --robot my.json --out {file}", ".png"),
]
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'


@pytest.mark.parametrize(("call", "name"), CALLS)
def test_no_command_writes_over_its_input(call: str, name: str, folder: Path) -> None:
    before = Path(name).read_bytes()
    done = RUN.invoke(app, call.format(name=folder.name).split())
    assert done.exit_code == 1 and "this command reads it; name another file" in done.stderr, done.output
    assert done.stderr.count("\n") == 1 and Path(name).read_bytes() == before


@pytest.mark.parametrize(("call", "suffix"), WRITERS)
def test_a_file_of_another_program_is_replaced_only_by_force(call: str, suffix: str, folder: Path) -> None:
    file = Path(f"notes{suffix}")
    words = call.format(file=file).split()
    for content in (b"", b"notes of the user", bytes(range(256))):
        file.write_bytes(content)
        done = RUN.invoke(app, words)
        assert done.exit_code == 1 and "name another file, or give --force" in done.stderr, done.output
        assert done.stderr.count("\n") == 1 and file.read_bytes() == content
    for again in (["--force"], []):  # then it is one of this program
        assert RUN.invoke(app, [*words, *again]).exit_code == 0


@pytest.mark.parametrize("ending", [".urdf", ".xml"])
def test_files_that_a_robot_refers_to_stay(ending: str, folder: Path) -> None:
    """Also where the output is not named but made, as in a folder."""
    pytest.importorskip("mujoco" if ending == ".xml" else "lxml")
    triangles = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    for name in ("foot.obj", "more.xml"):
        Path(name).write_text(triangles if name == "foot.obj" else "<mujocoinclude><asset/></mujocoinclude>")
    robot = {
        ".urdf": f'<robot name="r"><link name="a">{MESH.format("foot.obj")}</link></robot>',
        ".xml": '<mujoco><include file="more.xml"/><asset><mesh file="foot.obj"/></asset><worldbody><body><freejoint/>'
        '<geom type="mesh" mesh="foot"/></body></worldbody></mujoco>',
    }[ending]
    Path(f"r{ending}").write_text(robot)
    for force in ([], ["--force"]):
        RUN.invoke(app, ["list", "--robot", f"r{ending}", "--out", "r.png", *force])
        for name in ("foot.obj", "more.xml")[: 1 + (ending == ".xml")]:
            with nullcontext() if force else pytest.raises(OutputError, match="this command reads it"):
                write_text(folder / name, triangles)


def test_the_next_command_may_write_the_file(folder: Path) -> None:
    protect_inputs([folder / "w.json"])
    with pytest.raises(OutputError, match="this command reads it"):
        write_text(folder / "w.json", "")
    assert RUN.invoke(app, ["evaluate", "walk12", "--x", "p.csv", "--csv", "w.json", "--force"]).exit_code == 0
    protect_inputs([])
    write_text(folder / "w.json", "")


def test_an_exported_folder_keeps_files_of_others(tmp_path: Path) -> None:
    instance = gaitbench.load("walk12-w100")
    names = [path.name for path in export_objective(instance, tmp_path / "first")]
    export_objective(instance, tmp_path / "first")  # its own files are replaced
    for k, name in enumerate(names):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / name).write_text("#include <stdio.h>\nint main(void) { return 0; }\n")
        with pytest.raises(OutputError, match="did not write it"):
            export_objective(instance, folder)
        assert [path.name for path in folder.iterdir()] == [name]
