"""A study on a real Dask cluster on loopback, one worker of which is killed in the middle."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait.errors import InputError
from tests.compare.study.test_study import contents

pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="distributed not installed")  # slow to import

STUDY = StudySettings(
    problems=(ProblemSpec(name="walk12"),),
    solvers=(SolverSpec(name="pso", polish=True), SolverSpec(name="ga")),
    runs=3,
    stop=Stop(evaluations=200),
)


def dask(*arguments: str) -> subprocess.Popen[bytes]:
    """A process of Dask's command line that knows this package."""
    root = Path(__file__).parents[3]
    environment = {**os.environ, "PYTHONPATH": str(root), "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "30s"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]], env=environment, **quiet
    )


@pytest.fixture
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and its two workers."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    scheduler = dask("dask_scheduler", "--host", address, "--no-dashboard")
    workers = [
        dask("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        for _ in range(2)
    ]
    yield address, workers
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of Dask's own clean-up
def test_a_killed_worker_changes_nothing(cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path) -> None:
    from distributed import Client

    address, workers = cluster
    with Client(address, timeout="60s") as client:
        client.wait_for_workers(2, timeout=60)
    killed: list[Task] = []

    def kill_one(task: Task, record: RunRecord) -> None:
        if not killed:
            os.kill(workers[0].pid, signal.SIGKILL)
            killed.append(task)

    run_study(Study(tasks=STUDY.tasks(), folder=tmp_path / "cluster", scheduler=address), progress=kill_one)
    assert killed and workers[0].wait(10) == -signal.SIGKILL and workers[1].poll() is None
    run_study(Study(tasks=STUDY.tasks(), folder=tmp_path / "here"))
    assert contents(tmp_path / "cluster") == contents(tmp_path / "here")


@pytest.mark.filterwarnings("ignore")
def test_no_scheduler_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("compare.study.run_study.CONNECT_TIMEOUT", "1s")
    with pytest.raises(InputError, match="no Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        run_study(Study(tasks=STUDY.tasks(), folder=tmp_path, scheduler="tcp://127.0.0.1:9"))
