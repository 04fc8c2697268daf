"""Every example runs from another folder, prints what it promises, draws its figure and stays short.

The documentation's gallery runs all as they are, and ends at an error. Here those run whose printed numbers it cannot check,
long ones with fewer points, runs or starts.
"""

import ast
import json
import runpy
import shutil
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from compare.cli import app

ROOT = Path(__file__).parents[2]
MOST_LINES = 60  # of code
EXPECTED = {
    "first_solve.py": "limited by dbm_y_mean",
    "evaluate_your_own_x.py": "power 0.866844 W, feasible: True",
    "price_of_a_constraint.py": "0.845869 W, and 0.02373 W per millimetre",
    "your_own_objective.py": "0.0 W/s: 0.845869 W",
    "your_own_limit.py": "1.4 rad/s: 2.3059 W, converged",
    "your_own_problem.py": "5 of 5 starts of ipopt converged",
    "your_own_algorithm.py": "| shrinking-box | 2 | 2/2 |",
    "your_own_paper.py": "**Open:** PSO needs less power than GA (not run).",
    "results_from_matlab.py": "paper (MATLAB): 2 of 2 feasible, claims 1.0682 W, judged 0.6265 W at best",
    "custom_robot.py": "nao-with-a-load: 0 kg, 0.845869 W",
    "export_motion.py": "gait.motion: 102 lines",
}
FEWER = {
    "first_solve.py": ("starts=3", "starts=1"),
    "price_of_a_constraint.py": ("np.linspace(0.016, 0.024, 9)", "np.linspace(0.016, 0.024, 2)"),
    "your_own_objective.py": ("(0.0, 0.1, 0.3, 1.0)", "(0.0,)"),
    "your_own_limit.py": ("(3.0, 1.4, 1.2, 1.1)", "(1.4,)"),
    "your_own_algorithm.py": ("range(5)", "range(2)"),
    "custom_robot.py": ("(0.0, 0.5, 1.0)", "(0.0,)"),
}
# Run by the gallery alone: they print no number, or those of a sweep, a study and a simulation, which tests of these check.
GALLERY_ALONE = (
    "sweep.py",
    "front.py",
    "physics_engine.py",
    "notebook.py",
    "cluster.py",
    "tune_in_engine.py",
)
# For pages and commands; not in the gallery.
WITHOUT_FIGURE = {"bring_your_own.py", "welded_beam.py"}


def test_no_example_is_forgotten() -> None:
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == {*EXPECTED, *GALLERY_ALONE, *WITHOUT_FIGURE}


@pytest.mark.parametrize("name", [*EXPECTED, *GALLERY_ALONE])
def test_an_example_is_short(name: str) -> None:
    text = (ROOT / "examples" / name).read_text(encoding="utf-8")
    title = ast.parse(text).body[0]
    lines = [line.strip() for line in text.splitlines()[title.end_lineno :]]
    assert sum(1 for line in lines if line and not line.startswith("#")) <= MOST_LINES


@pytest.mark.commit
@pytest.mark.parametrize("name", EXPECTED)
def test_example(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, which has loaded the packages already."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name])
    text, (many, few) = (ROOT / "examples" / name).read_text(encoding="utf-8"), FEWER.get(name, ("", ""))
    assert not many or text.count(many) == 1
    (tmp_path / name).write_text(text.replace(many, few), encoding="utf-8")
    for table in (ROOT / "examples").glob(f"{Path(name).stem}.csv"):
        shutil.copy(table, tmp_path)
    monkeypatch.syspath_prepend(ROOT / "examples")
    found = runpy.run_path(str(tmp_path / name), run_name="__main__")
    printed = capsys.readouterr().out
    assert EXPECTED[name] in printed
    assert isinstance(found["figure"], Figure) and found["figure"].axes
    plt.close("all")


@pytest.mark.commit
def test_a_paper_of_two_files_is_reproduced_by_the_command(tmp_path: Path) -> None:
    """From any folder that has both files, with its searches."""
    for name in ("your_own_paper.py", "your_own_paper.csv", "your_own_problem.py"):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    done = CliRunner().invoke(app, ["reproduce", str(tmp_path / "your_own_paper.py"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert record["verdicts"] == {id: {"as printed": "holds"} for id in ("power", "faster", "better")}
    assert {"report.html", "speeds.svg", "claims.csv", "runs.csv"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }


def test_the_three_kinds_of_user_code(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(ROOT / "examples" / "bring_your_own.py"), run_name="__main__")
    assert "annealing, 2000 evaluations: power " in capsys.readouterr().out
