"""Files and outputs of commands: inputs and files of other programs stay, and what cannot be written is one sentence."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from compare.__main__ import fix_environment, main
from nlp_gait import load
from tests.compare.cli.calls import nlp_gait, one_sentence
from tests.faults.processes import ROOT, in_own_mounts
from tests.robots.custom import humanoid

X = "--x 0.1,0.1,0.01,0.01"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a robot, a source file, points and a result."""
    monkeypatch.chdir(tmp_path)
    Path("my.json").write_text(json.dumps(humanoid()))
    shutil.copy(ROOT / "examples" / "bring_your_own.py", "byo.py")
    names = load("walk12").names
    Path("p.csv").write_text(",".join(names) + "\n" + ",".join(["0.1"] * len(names)) + "\n")
    Path("w.json").write_text(json.dumps({"problem": "walk12", "x": dict.fromkeys(names, 0.1)}))
    Path("link.json").symlink_to("my.json")
    return tmp_path


@pytest.mark.parametrize(
    ("call", "name"),
    [
        ("solve nao-dsp --robot link.json --starts 1 --out my.json", "my.json"),
        ("list --robot my.json --out my.json", "my.json"),
        ("solve byo.py:two_link --starts 1 --out byo.py", "byo.py"),
        ("export w.json --to json --out w.json", "w.json"),
    ],
)
def test_no_command_writes_over_its_input(call: str, name: str, folder: Path) -> None:
    before = Path(name).read_bytes()
    assert "it exists; name another file, or give --force" in one_sentence(*call.split())
    assert Path(name).read_bytes() == before


@pytest.mark.parametrize(
    ("call", "name"),
    [
        ("evaluate walk12 --x p.csv --csv {}", "notes.csv"),
        ("export w.json --to json --out {}", "notes.json"),
        ("solve byo.py:two_link --starts 1 --out {}", "notes.json"),
        ("export walk12-w100 --to objective --out .", "gaitbench_walk12_w100.cpp"),
    ],
)
def test_a_file_of_another_program_is_replaced_only_by_force(call: str, name: str, folder: Path) -> None:
    words = call.format(name).split()
    for content in (b"", bytes(range(256))):
        Path(name).write_bytes(content)
        before = set(folder.iterdir())
        assert "name another file, or give --force" in one_sentence(*words)
        assert Path(name).read_bytes() == content and set(folder.iterdir()) == before
    nlp_gait(*words, "--force")


PRINTS = "print(chr(0x202f))"
BREAKS = "(_ for _ in ()).throw(BrokenPipeError(32, ''))"


@pytest.mark.parametrize(
    ("script", "status", "printed", "said"),
    [
        (f"PYTHONIOENCODING=ascii $gait evaluate walk12 {X}", 0, "walk12: f ", ""),
        (f'PYTHONIOENCODING=ascii $run "{PRINTS}"', 0, "?\n", ""),
        ("$gait --version >&-", 1, "", "nlp-gait: standard output is closed; send it to a file or to /dev/null\n"),
        ("$gait solve --help >/dev/full", 1, "", "nlp-gait: cannot write the output: No space left on device\n"),
        (f'{{ sleep 0.2; $run "{BREAKS}"; echo $? >&2; }} | true', 0, "", "1\n"),
    ],
)
def test_outputs_that_are_closed_full_or_of_another_encoding(script: str, status: int, printed: str, said: str) -> None:
    code = "import sys; from compare.cli.command import run_app; run_app(lambda: eval(sys.argv[1]))"
    words = {"$gait": f"{sys.executable} -P -m nlp_gait", "$run": f"{sys.executable} -c '{code}'"}
    for name, command in words.items():
        script = script.replace(name, command)
    done = subprocess.run(
        ["sh", "-c", script],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (status, said)
    assert done.stdout.startswith(printed) and bool(done.stdout) == bool(printed)


@pytest.mark.parametrize(
    "arguments",
    [
        "solve walk12 --starts 1 --out",
        "sweep walk12 --over foot_lift_m=0.01,0.02 --out",
    ],
)
def test_a_name_that_is_not_text_is_refused_before_the_work(arguments: str, tmp_path: Path) -> None:
    error = one_sentence(*arguments.split(), os.fsdecode(bytes(tmp_path / "f") + b"\xff"))
    assert "its name is not valid UTF-8; choose another name" in error
    assert list(tmp_path.iterdir()) == []


def test_no_room_for_temporary_files_is_one_sentence(tmp_path: Path) -> None:
    program = Path("/srv") / Path(sys.executable).relative_to(sys.prefix)
    fill = 'mount -t tmpfs -o size=4k none "$place"; head -c 4096 /dev/zero > "$place/x"; '
    script = (
        'mkdir "$2/cache"; mount --bind "$2/cache" /mnt; mount --bind "$PWD" /media; '  # all of which may lie in /tmp
        f'mount --bind "{sys.prefix}" /srv; '
        f"for place in /tmp /var/tmp /dev/shm; do {fill} done; [ ! -d /usr/tmp ] || {{ place=/usr/tmp; {fill} }}; "
        "export TMPDIR=/tmp XDG_CACHE_HOME=/mnt PYTHONPATH=/media; cd /dev/shm; "
        f'"{program}" -P -m nlp_gait solve walk12 --starts 1'
    )
    done = in_own_mounts(script, str(tmp_path))
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("nlp-gait: no folder for temporary files: ") and "TMPDIR" in done.stderr


@pytest.mark.parametrize("width", ["-5", "wide", "80"])
def test_a_terminal_without_a_width_has_the_usual_one(width: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    fix_environment()
    assert os.environ.get("COLUMNS") == ("80" if width == "80" else None) and os.environ["MPLBACKEND"] == "agg"


def test_a_working_folder_that_is_gone_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(SystemExit, match="the working folder does not exist any more; change to another one"):
        main()
