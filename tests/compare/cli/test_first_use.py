"""First steps with the package."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import nlp_gait
from compare.analysis.columns import PRINTED
from compare.cli import PANELS, app, printing
from compare.cli.printing import PlainConsole, print_table
from tests.compare.cli.calls import as_json

ROOT = Path(__file__).parents[3]
HEADER = (
    "solver",
    "feasible",
    "best known objective",
    "worst of all runs",
    "evaluations",
    "what it says of itself",
)
ROWS = [
    ("ipopt", "5/5", "0.531886 W", "0.531886 W", "1 793", "converged to a locally optimal point, as always"),
    ("aco", "3/3", "0.531886 W", "0.531889 W", "10 000", "evaluation budget used"),
]


def printed(monkeypatch, capsys, width):
    monkeypatch.setattr(printing, "stdout", PlainConsole(highlight=False, markup=False, width=width))
    print_table("Solvers", HEADER, ROWS)
    return capsys.readouterr().out


@pytest.mark.parametrize("width", [200, 80, 60])
def test_no_table_is_wider_than_the_terminal_and_none_loses_a_cell(monkeypatch, capsys, width):
    text = printed(monkeypatch, capsys, width)
    assert max(map(len, text.splitlines())) <= width
    for row in ROWS:
        assert all(word in text for cell in row for word in cell.split())
    assert ("  feasible: 3/3\n  best known objective: 0.531886 W\n" in text) == (width == 60)


def test_the_columns_of_a_study_fit_eighty_columns_with_names_of_sixteen_letters(monkeypatch, capsys):
    monkeypatch.setattr(printing, "stdout", PlainConsole(highlight=False, markup=False, width=80))
    row = ("genetic-algorit1", "31/31", "< 0.0001 %", "31/31", "10\u202f000", "12.3")
    print_table("Solvers", ("solver", *(column.title for column in PRINTED)), [row])
    text = capsys.readouterr().out
    assert "feasible:" not in text and all(word in text for cell in row for word in cell.split())


def test_help_shows_every_command_in_a_panel_and_the_version_is_the_package_s():
    shown = CliRunner().invoke(app, ["-h"]).stdout
    assert all(panel in shown for panel in PANELS)
    screen = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80"}).stdout.strip()
    assert screen.count("\n") < 45 and "..." not in screen.split("COMMAND [ARGS]...")[1]
    assert CliRunner().invoke(app, ["--version"]).stdout.strip() == nlp_gait.__version__


def test_a_users_own_compare_py_is_not_taken_for_the_package(tmp_path):
    (tmp_path / "compare.py").write_text("raise SystemExit('the wrong compare')")
    environment = {**os.environ, "PYTHONPATH": ""}
    command = [sys.executable, "-m", "nlp_gait", "--version"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.strip() == nlp_gait.__version__


def test_the_python_of_the_readme_runs_as_pasted():
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    found: dict[str, object] = {}
    exec(code.replace("starts=20", "starts=1").replace("10_000", "500"), found)  # noqa: S102
    assert found["optimum"].converged and found["result"].objective >= found["optimum"].objective


def test_a_broken_pipe_does_not_lose_the_solution_file(tmp_path):
    target = tmp_path / "best.json"
    command = f"{sys.executable} -P -m nlp_gait solve walk12 --starts 1 --out {target} | true"
    subprocess.run(command, shell=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False)
    assert '"claimed": true' in target.read_text()


def test_every_setting_of_every_algorithm_is_listed_with_its_meaning():
    from compare.study.description import describe_solver, list_described_names

    for name in list_described_names():
        found = describe_solver(name)
        assert found.title and all(setting.meaning for setting in found.settings), name
    (swarm,) = as_json("list", "pso")["algorithms"]
    assert {"name": "inertia_damping", "default": "0.99"}.items() <= swarm["settings"][2].items()
    assert "Kennedy, Eberhart (1995)" in swarm["source"]
