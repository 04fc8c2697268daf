"""``bench``, and ``export`` of problems as users call them."""

from pathlib import Path

import pytest

from compare.bench.leaderboard import BASELINE
from nlp_gait import gaitbench
from tests.compare.cli.calls import as_json, nlp_gait

pytestmark = pytest.mark.usefixtures("coarse_pictures")

ID = "walk12-w015"
EXAMPLE = Path(__file__).parents[3] / "examples" / "bring_your_own.py"


@pytest.mark.commit
def test_bench_ranks_a_user_algorithm(tmp_path: Path) -> None:
    """By ``file.py:name``, without glue; called again it runs nothing and says the same."""
    out = tmp_path / "out"
    effort = f"--instances {ID} --runs 3 --jobs 1".split()
    call = ("bench", "--algorithm", f"{EXAMPLE}:Shrinking", *effort, "--out", out)
    found = as_json(*call)
    assert 1 <= found["rank"] <= 13 and found["instances"] == [ID]
    assert {s["solver"] for s in found["standings"]} == {*BASELINE, found["solver"]}
    assert (out / "leaderboard.html").is_file() and (out / "gaitbench-runtime.svg").is_file()
    records = list((out / "records").glob("*/*.json"))
    assert len(records) == 3
    times = [path.stat().st_mtime_ns for path in records]
    shown = nlp_gait(*call).stdout
    assert [path.stat().st_mtime_ns for path in records] == times
    assert f"takes place {found['rank']} of 13" in shown
    sentences = ("wrote", "takes place", "better")
    assert max(len(line) for line in shown.splitlines() if not any(word in line for word in sentences)) <= 80


def test_bench_shows_the_baseline_alone(tmp_path: Path) -> None:
    found = as_json("bench", "--instances", ID, "--out", tmp_path)
    assert found["rank"] is None and len(found["standings"]) == 12


@pytest.mark.usefixtures("without_compiler")
def test_bench_runs_others_where_no_baseline_is_shipped(tmp_path: Path) -> None:
    """On instances by seed; another budget has no baseline either."""
    call = ("--algorithm", f"{EXAMPLE}:Shrinking", "--runs", "2", "--evaluations", "200", "--jobs", "1")
    found = as_json(
        "bench", *call, "--families", "walk12-long", "--seeds", "3:5", "--against", "random,pso", "--out", tmp_path
    )
    assert found["instances"] == ["gb2:walk12-long:3", "gb2:walk12-long:4"]
    assert {s["solver"] for s in found["standings"]} == {"random", "pso", found["solver"]}
    shown = (tmp_path / "leaderboard.md").read_text(encoding="utf-8")
    assert "gb2:walk12-long:4" in shown and "2 runs on each instance, with 200 evaluations" in shown
    few = ("--families", "walk12-long", "--seeds", "3:4", "--runs", "2", "--evaluations", "60", "--jobs", "1")
    named = as_json("bench", "--algorithm", "pso", *few, "--against", "pso,random", "--out", tmp_path / "named")
    assert {s["solver"]: s["mean_rank"] for s in named["standings"]} == {"my-pso": 1.5, "random": 1.5}


def test_instances_are_problems_everywhere(tmp_path: Path) -> None:
    """One name space: a problem, an instance of GaitBench and a generated one."""
    drawn = "gb2:walk12-long:3"
    assert as_json("list", drawn)["variables"][0]["name"] == "z1"
    x = ",".join(map(repr, gaitbench.load(ID).best_x.tolist()))
    assert as_json("evaluate", ID, "--x", x)["feasible"]
    solved = as_json("solve", drawn, "--starts", "2", "--out", tmp_path / "best.json")
    assert solved["objective"] == pytest.approx(-gaitbench.load(drawn).best_known, rel=1e-5)
    best = ",".join(map(repr, solved["x"].values()))
    assert as_json("evaluate", drawn, "--x", best)["feasible"]
    files = [Path(name) for name in as_json("export", drawn, "--to", "objective", "--out", tmp_path / "c")["files"]]
    assert {path.suffix for path in files} == {".c", ".cpp", ".h", ".jl", ".m", ".sh"}
    assert all(path.is_file() for path in files) and "gaitbench_gb2_walk12_long_3.h" in {path.name for path in files}
