"""A study on a real Dask cluster on loopback: its workers find user code, and a killed worker or scheduler loses no run."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from compare.study.record import RunRecord
from compare.study.run import ProblemSpec, plan_runs
from compare.study.study import Study, run_study
from nlp_gait.errors import InputError, WorkerError
from tests.compare.study.test_study import contents
from tests.extras import need

need("distributed")

WALK = ProblemSpec(name="walk12")
SEARCHES = [("", "pso"), ("", "ga")]


def dask(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """A process of Dask's command line that knows this package, in another folder than the study's."""
    root = Path(__file__).parents[3]
    environment = {**os.environ, "PYTHONPATH": str(root), "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "30s"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]], env=environment, cwd=folder, **quiet
    )


@pytest.fixture
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and it with its two workers."""
    folder = tmp_path_factory.mktemp("workers")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{probe.getsockname()[1]}"
    scheduler = dask(folder, "dask_scheduler", "--host", address, "--no-dashboard", "--idle-timeout", "2m")
    workers = [
        dask(folder, "dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        for _ in range(2)
    ]
    yield address, [scheduler, *workers]
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


OWN = """
import numpy as np
from helper import draw

def search(evaluate, lower, upper, evaluations, seed):
    rng = np.random.default_rng(seed)
    for _ in range(evaluations):
        evaluate(draw(rng, lower, upper)[None])
"""


@pytest.mark.filterwarnings("ignore")  # of Dask's own clean-up
def test_workers_find_user_code_and_killed_processes_lose_no_run(
    cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import Client

    address, (scheduler, *workers) = cluster
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text(OWN)
    Path("helper.py").write_text("def draw(rng, lower, upper):\n    return rng.uniform(lower, upper)\n")
    own = ("", "own.py:search")
    runs = plan_runs([WALK], [*SEARCHES, ("", "ipopt"), own], runs=3, starts=3, evaluations=200)
    with Client(address, timeout="60s") as client:
        client.wait_for_workers(2, timeout=60)
    finished: list[RunRecord] = []

    def kill_a_worker(record: RunRecord) -> None:
        if not finished:
            os.kill(workers[0].pid, signal.SIGKILL)
        finished.append(record)

    run_study(Study(runs=runs, folder=tmp_path / "cluster", scheduler=address), progress=kill_a_worker)
    assert workers[0].wait(10) == -signal.SIGKILL and workers[1].poll() is None
    run_study(Study(runs=runs, folder=tmp_path / "here"))
    assert contents(tmp_path / "cluster") == contents(tmp_path / "here")
    finished.clear()

    def kill_the_scheduler(record: RunRecord) -> None:
        scheduler.kill()
        finished.append(record)

    more = plan_runs([WALK], [own], runs=30, starts=1, evaluations=2000)
    with pytest.raises(WorkerError, match="failed: .*; finished runs are stored: rerun the same command to continue"):
        study = Study(runs=more, folder=tmp_path / "lost", scheduler=address)
        run_study(study, progress=kill_the_scheduler)
    assert 0 < len(finished) == len(list((tmp_path / "lost" / "records").rglob("*.json"))) < len(more)


@pytest.mark.filterwarnings("ignore")
def test_no_scheduler_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("compare.study.study.CONNECT_TIMEOUT", "1s")
    with pytest.raises(InputError, match="no Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        runs = plan_runs([WALK], SEARCHES, runs=1, starts=1, evaluations=200)
        run_study(Study(runs=runs, folder=tmp_path, scheduler="tcp://127.0.0.1:9"))
