"""A program as a solver of a study: by its command, with its files' hash, repeated and archived only where it is named."""

import json
import sys
from pathlib import Path

import pytest

from tests.compare.cli.calls import as_json, nlp_gait, one_sentence

PROGRAM = """
import json, random, sys, shared
problem = json.loads(sys.stdin.readline())
rng = random.Random(problem["seed"])
answer = {}
while "stop" not in answer:
    x = [[rng.uniform(*ends) for ends in zip(problem["lower"], problem["upper"])] for _ in range(shared.ROWS)]
    print(json.dumps({"x": x}), flush=True)
    answer = json.loads(sys.stdin.readline())
"""


def read_points(study: str) -> dict[str, object]:
    return {
        path.name: json.loads(path.read_text())["x"] for path in Path(study).glob("records/walk12/my_search-*.json")
    }


def test_a_program_takes_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, coarse_pictures: None) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my_search.py").write_text(PROGRAM)
    Path("shared.py").write_text("ROWS = 20\n")
    command = f"cmd:{sys.executable} my_search.py"
    call = ["compare", "walk12", "--starts", "0", "--runs", "2", "--evaluations", "100", "--jobs", "1"]
    nlp_gait(*call, "--algorithms", f"random,{command}", "--out", "study")
    points = read_points("study")
    assert len(points) == 2
    nlp_gait(*call, "--algorithms", command, "--out", "study")
    assert read_points("study") == points
    nlp_gait("verify", "study", "--pack", "study.zip", "--code", command)
    (row,) = as_json("verify", "study.zip")["rows"]
    assert row["kind"] == "not repeated" and row["why"].endswith("is packed, and runs only with --run-code")
    everything = "4 points evaluated and 4 of 4 runs repeated: nothing differs"
    assert as_json("verify", "study.zip", "--run-code")["sentence"] == everything
    Path("shared.py").write_text("ROWS = 30\n")
    nlp_gait(*call, "--algorithms", command, "--out", "study")
    assert len(read_points("study")) == 4


def test_a_command_that_cannot_run_is_refused_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call = ["compare", "walk12", "--out", "study", "--algorithms"]
    assert "no program 'no-such-program' on this machine" in one_sentence(*call, "cmd:no-such-program ga.m")
    assert "names no program" in one_sentence(*call, "cmd:")
    assert "No closing quotation" in one_sentence(*call, "cmd:sh -c 'exit")
    assert "an algorithm, not a problem" in one_sentence("compare", "cmd:sh", "--out", "study")
    assert not list(Path("study").glob("records/**/*.json"))
