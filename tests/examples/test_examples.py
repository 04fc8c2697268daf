"""Every example runs as it stands, from another folder, and prints what it promises."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

from compare.study.settings import read_settings
from compare.study.study import Study, check_study

ROOT = Path(__file__).parents[2]
EXPECTED = {
    "solve_and_plot.py": "held back by dbm_y_mean",
    "evaluate_your_own_x.py": "power 0.866844 W, feasible: True",
    "your_own_objective.py": "0.0 W/s: 0.845869 W",
    "your_own_algorithm.py": "| box-0.97 | 5 |",
    "bring_your_own.py": "annealing, 2000 evaluations: power ",
    "sweep.py": "15.0 mm: 0.84587 W, converged",
    "custom_robot.py": "nao-with-a-load: ",
}


def test_no_example_is_forgotten() -> None:
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXPECTED)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_example(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, which has loaded the packages already."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name])
    runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    printed = capsys.readouterr().out
    assert EXPECTED[name] in printed
    assert len(printed.splitlines()) > 1


def test_the_study_file_can_run() -> None:
    settings = read_settings(ROOT / "examples" / "study.toml")
    study = Study(tasks=settings.tasks())
    check_study(study)
    assert len(study.tasks) == 2 * (31 + 31 + 2 * 31 + 31 + 11)
