"""Steps of questions in their memo: by several processes, damaged, and of a changed robot."""

import os
from functools import partial
from importlib.resources import files
from pathlib import Path

import pytest

import nlp_gait
from compare.questions.certainty import Certainty
from compare.questions.question import Work, find
from compare.study.memo import Memo


def test_results_of_another_robot_are_others(tmp_path: Path) -> None:
    robot = tmp_path / "my.json"
    text = (files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8")
    heavy = text.replace('"mass_kg": 1.04956', '"mass_kg": 1.5')
    assert heavy != text
    powers, stored = [], []
    for content in (text, heavy, text):
        robot.write_text(content, encoding="utf-8")
        problem = nlp_gait.load("nao-ssp", robot=str(robot), intervals=2).fix(swing_height_m=0.02)
        certainty = Certainty(problem=problem, starts=1, time_limit_s=0.0)
        powers.append(find(certainty, Work(memo=Memo(tmp_path))).optima[0].objective)
        stored.append(len(list((tmp_path / "store").iterdir())))
    assert powers[1] > powers[0] == powers[2]
    assert stored == [1, 2, 2]


def record_call(folder: Path, number: int) -> dict[str, float]:
    (folder / f"{number}-{os.getpid()}").touch()
    return {"third": number / 3.0}


@pytest.mark.parametrize("jobs", [1, 3])
def test_results_are_computed_once_and_damaged_ones_again(jobs: int, tmp_path: Path) -> None:
    out, calls = tmp_path / "out", tmp_path / "calls"
    calls.mkdir()
    computations = {f"step-{k}": ({"k": k}, partial(record_call, calls, k)) for k in range(6)}
    expected = {f"step-{k}": {"third": k / 3.0} for k in range(6)}
    assert Memo(out).compute_all(computations, jobs=jobs) == expected  # every bit
    assert len({path.name.partition("-")[2] for path in calls.iterdir()} - {str(os.getpid())}) == (
        3 if jobs == 3 else 0
    )
    for path, content in zip(sorted((out / "store").iterdir()), ("", "{", '{"result"}', "{}", "[]"), strict=False):
        path.write_text(content)
    assert Memo(out).compute_all(computations, jobs=jobs) == expected
    assert sorted(path.name[0] for path in calls.iterdir()).count("5") == 1
    assert Memo(out).compute("step-5", {"k": 6}, lambda: None) is None  # other inputs
