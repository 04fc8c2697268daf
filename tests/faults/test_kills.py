"""kill -9 at random moments in what is kept step by step."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.study.store import Store
from tests.compare.questions.test_resuming import without_times
from tests.faults.processes import ROOT, start

RUN = CliRunner()
STEM = "walk12-sweep-step_length_m-ipopt"
PROGRAM = """
import sys, time
from pathlib import Path
from compare.study.store import Store

def work(number):
    time.sleep(0.03)
    return [number] * 20_000

store = Store(Path(sys.argv[1]))
for number in range(20):
    store.compute(f"step-{number}", {"number": number}, lambda: work(number))
"""


@pytest.mark.slow
def test_a_reproduction_killed_and_continued_ends_as_undisturbed(tmp_path: Path) -> None:
    moments, folder = random.Random(1), tmp_path / "store"
    finished = 0
    for _ in range(3):
        process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(tmp_path)], cwd=ROOT)
        wanted = finished + moments.randint(1, 4)
        while process.poll() is None and len(list(folder.glob("*.json"))) < wanted:
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.04))
        process.kill()
        process.wait()
        before, finished = finished, len(list(folder.glob("*.json")))
        assert finished >= before  # nothing finished is lost
        for path in folder.glob("*.json"):
            json.loads(path.read_text())  # whole or absent
    notes: list[str] = []
    compute = partial(Store(tmp_path).compute, progress=notes.append)
    results = [compute(f"step-{n}", {"number": n}, lambda n=n: [n] * 20_000) for n in range(20)]
    assert results == [[n] * 20_000 for n in range(20)]
    assert sum("stored by an earlier run" in note for note in notes) == finished > 0


@pytest.mark.slow
def test_a_sweep_killed_and_interrupted_ends_as_undisturbed(tmp_path: Path, undrawn_pictures: None) -> None:
    command = ("sweep", "walk12", "--over", "step_length_m=0.06:0.12:4", "--starts", "1")
    RUN.invoke(app, [*command, "--out", str(tmp_path / "undisturbed")])
    killed, steps = tmp_path / "killed", tmp_path / "killed" / "store"
    for number, wanted in ((signal.SIGKILL, 2), (signal.SIGINT, 4)):
        process = start(*command, "--out", str(killed))
        while process.poll() is None and len(list(steps.glob("solve-*.json"))) < wanted:
            time.sleep(0.01)
        process.send_signal(number)
        _, messages = process.communicate(timeout=60)
        assert process.returncode == (-9 if number == signal.SIGKILL else 130), messages
    *_, said = messages.splitlines()
    assert said.startswith("nlp-gait: interrupted after") and said.endswith("; rerun the command to continue")
    done = RUN.invoke(app, [*command, "--out", str(killed)])
    assert "results were stored by an earlier run" in done.stderr
    whole, resumed = (
        without_times(json.loads((tmp_path / name / f"{STEM}.json").read_text())) for name in ("undisturbed", "killed")
    )
    assert resumed == whole and len(whole["points"]) == 4
    names = [{path.name for path in (tmp_path / name / "store").iterdir()} for name in ("undisturbed", "killed")]
    assert names[0] == names[1]


@pytest.mark.slow
def test_the_result_of_an_earlier_solve_survives_a_killed_one(tmp_path: Path) -> None:
    out = tmp_path / "best.json"
    RUN.invoke(app, ["solve", "walk12", "--starts", "1", "--out", str(out)])
    before = out.read_bytes()
    process = start("solve", "walk12", "--starts", "100000", "--out", str(out))
    time.sleep(random.Random(2).uniform(1.0, 2.0))
    process.kill()
    process.communicate()
    assert out.read_bytes() == before
