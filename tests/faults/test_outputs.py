"""Outputs that are closed, full, of another encoding, or named in bytes that are no text: a result or one sentence."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from compare.cli.command import run_app
from nlp_gait import __version__, load, make_solver, solve
from nlp_gait.backends.kernel.compiler import _find, find_compiler
from nlp_gait.errors import GaitError
from tests.compare.cli.calls import one_sentence
from tests.faults.processes import ROOT, in_own_mounts

FULL = Path("/dev/full")
EVALUATE = "evaluate walk12 --x 0.1,0.1,0.01,0.01"


def shell(script: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A line of sh in which ``$gait`` is the command line."""
    return subprocess.run(
        ["sh", "-c", f'gait="{sys.executable} -P -m nlp_gait"; {script}'],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="surrogateescape",
        timeout=120,
    )


@pytest.mark.slow
def test_numbers_are_printed_in_every_encoding(monkeypatch: pytest.MonkeyPatch) -> None:
    done = shell(f"$gait {EVALUATE}", PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    for encoding in ("ascii", "latin-1", "cp1252"):
        stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        monkeypatch.setattr(sys, "stdout", stream)
        run_app(lambda: print("1\u202f000"))
        stream.flush()
        assert stream.buffer.getvalue() == b"1?000\n"  # type: ignore[attr-defined]


@pytest.mark.slow
def test_a_closed_output_is_refused_before_anything_is_written_into_a_file_in_its_place() -> None:
    done = shell("$gait --version >&-")
    assert done.returncode == 1 and done.stderr.startswith("nlp-gait: standard output is closed; ")
    assert done.stderr.count("\n") == 1
    closed = shell("$gait --version 2>&-")
    assert (closed.returncode, closed.stdout.strip()) == (0, __version__)
    assert shell("$gait list nosuch 2>&-").returncode == 1


@pytest.mark.slow
@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
def test_help_that_cannot_be_written_is_reported() -> None:
    done = shell("$gait solve --help >/dev/full")
    assert (done.returncode, done.stderr) == (1, "nlp-gait: cannot write the output: No space left on device\n")


@pytest.mark.slow
def test_a_broken_pipe_is_silent_only_if_it_is_the_outputs() -> None:
    pipe = "import errno, sys; from compare.cli.command import run_app\ndef fails(): raise BrokenPipeError(errno.EPIPE, '')\n"
    program = f'{sys.executable} -c "{pipe}run_app(fails)"'
    done = shell(program)
    assert (done.returncode, done.stderr) == (1, "nlp-gait: a child process exited unexpectedly\n")
    assert shell(f"{{ sleep 0.2; {program}; echo $? >&2; }} | true").stderr == "1\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        "compare walk12 --runs 1 --starts 1 --evaluations 100 --out",
        "solve walk12 --starts 1 --out",
        "sweep walk12 --over foot_lift_m=0.01,0.02 --out",
        "evaluate walk12 --x 0.1,0.1,0.01,0.01 --signals",
    ],
)
def test_a_name_that_is_not_text_is_refused_before_the_work(arguments: str, tmp_path: Path) -> None:
    error = one_sentence(*arguments.split(), os.fsdecode(bytes(tmp_path / "f") + b"\xff"))
    assert "its name is not valid UTF-8; choose another name" in error
    assert list(tmp_path.iterdir()) == []


def test_robots_and_code_that_no_record_could_name_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"f\xff")
    folder.mkdir()
    (folder / "mine.json").write_text('{"schema": 1, "name": "mine", "extends": "nao-v5"}')
    (folder / "own.py").write_text("from nlp_gait import load\nwalk = load('walk12')\n")
    for problem, options in (("nao-dsp", {"robot": f"{folder}/mine.json"}), (f"{folder}/own.py:walk", {})):
        with pytest.raises(GaitError, match="not valid UTF-8; choose another name"):
            load(problem, **options)


@pytest.mark.parametrize("path", [".", "..", "nosuch/..", "/"])
def test_a_folder_in_place_of_a_result_is_reported(path: str) -> None:
    for command in (["export", path, "--to", "gif"], ["export", path, "--to", "csv"], ["simulate", path]):
        assert "cannot be read" in one_sentence(*command)


@pytest.mark.slow
def test_no_room_for_temporary_files_is_one_sentence(tmp_path: Path) -> None:
    inside = Path(sys.executable).is_relative_to(ROOT)
    program = Path("/media") / Path(sys.executable).relative_to(ROOT) if inside else sys.executable
    fill = 'mount -t tmpfs -o size=4k none "$place"; head -c 4096 /dev/zero > "$place/x"; '
    script = (
        'mkdir "$2/cache"; mount --bind "$2/cache" /mnt; mount --bind "$PWD" /media; '  # which may lie in /tmp
        f"for place in /tmp /var/tmp /dev/shm; do {fill} done; [ ! -d /usr/tmp ] || {{ place=/usr/tmp; {fill} }}; "
        "export TMPDIR=/tmp XDG_CACHE_HOME=/mnt PYTHONPATH=/media; cd /dev/shm; "
        f'"{program}" -P -m nlp_gait solve walk12 --starts 1'
    )
    done = in_own_mounts(script, str(tmp_path))
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("nlp-gait: no folder for temporary files: ") and "TMPDIR" in done.stderr


@pytest.mark.parametrize("named", ['g++ "', '""', "'", "g++ \\"])
def test_a_compiler_that_is_not_a_command_line_is_skipped(named: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CXX", raising=False)
    usual = find_compiler().command
    monkeypatch.setenv("CXX", named)
    assert find_compiler().command == usual
    _find.cache_clear()


def test_slsqp_with_every_variable_fixed_ends_at_that_point() -> None:
    problem = load("walk12")
    x = problem.by_name((problem.lower + problem.upper) / 2)
    found = solve(problem, fix=x, solver=make_solver("slsqp"))
    assert dict(found.x) == pytest.approx(x) and found.best.iterations == 0
