"""kill -9 at random moments in what is kept step by step; more: ``python -m benchmarks.faults.kill_and_resume``."""

from __future__ import annotations

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from compare.study.steps import Steps
from tests.faults.processes import ROOT, start

PROGRAM = """
import sys, time
from pathlib import Path
from compare.study.steps import Steps

def work(number):
    time.sleep(0.03)
    return [number] * 20_000

steps = Steps(Path(sys.argv[1]), lambda note: None)
for number in range(20):
    steps(f"step-{number}", {"number": number}, lambda: work(number))
"""


@pytest.mark.slow
def test_a_reproduction_killed_and_continued_ends_as_undisturbed(tmp_path: Path) -> None:
    moments, folder = random.Random(1), tmp_path / "steps"
    finished = 0
    for _ in range(4):
        process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(tmp_path)], cwd=ROOT)
        wanted = finished + moments.randint(1, 4)
        while process.poll() is None and len(list(folder.glob("*.json"))) < wanted:
            time.sleep(0.001)
        time.sleep(moments.uniform(0.0, 0.04))
        process.kill()
        process.wait()
        before, finished = finished, len(list(folder.glob("*.json")))
        assert finished >= before  # nothing finished is lost
        for path in folder.glob("*.json"):
            json.loads(path.read_text())  # whole or absent
    notes: list[str] = []
    steps = Steps(tmp_path, notes.append)
    results = [steps(f"step-{n}", {"number": n}, lambda n=n: [n] * 20_000) for n in range(20)]
    assert results == [[n] * 20_000 for n in range(20)]
    assert sum("kept from an earlier run" in note for note in notes) == finished > 0


@pytest.mark.slow
def test_the_result_of_an_earlier_solve_survives_a_killed_one(tmp_path: Path) -> None:
    out = tmp_path / "best.json"
    start("solve", "walk12", "--starts", "1", "--out", str(out)).communicate(timeout=60)
    before = out.read_bytes()
    process = start("solve", "walk12", "--starts", "100000", "--out", str(out))
    time.sleep(random.Random(2).uniform(1.0, 2.0))
    process.kill()
    process.communicate()
    assert out.read_bytes() == before
