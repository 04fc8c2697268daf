"""Processes and programs that the tests of faults share."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def start(*arguments: str, **environment: str) -> subprocess.Popen[str]:
    """Start the command line in its own process group, as a terminal would, also under nohup."""
    return subprocess.Popen(
        [sys.executable, "-m", "nlp_gait", *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def is_alive(pid: int) -> bool:
    """Return whether a process runs, by /proc."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def in_own_mounts(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a shell script that may mount private file systems; the test is skipped where that is not allowed."""
    unshare = shutil.which("unshare")
    if unshare is None or subprocess.run([unshare, "-rm", "true"], capture_output=True).returncode != 0:
        pytest.skip("mounting needs user namespaces")
    return subprocess.run(
        [unshare, "-rm", "sh", "-euc", script, "sh", sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )


def fake_compiler(folder: Path, body: str) -> str:
    """Write a compiler that is a shell script: it answers ``--version``, and then runs the body."""
    path = folder / "compiler.sh"
    path.write_text(f'#!/bin/sh\nif [ "$1" = --version ]; then echo "fake 1"; exit 0; fi\n{body}\n', encoding="ascii")
    path.chmod(0o700)
    return str(path)
