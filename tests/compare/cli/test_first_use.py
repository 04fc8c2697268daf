"""First steps with the package; what `solve` prints: at most 40 lines, the dearest constraints first."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import nlp_gait
from compare.analysis.columns import PRINTED
from compare.cli import PANELS, app, command, solve
from compare.cli.command import PlainConsole, Rows, print_table
from nlp_gait.formulation.solution import ActiveConstraint
from tests.backends.toys import corner, toy
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
    monkeypatch.setattr(command, "stdout", PlainConsole(highlight=False, markup=False, width=width))
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
    monkeypatch.setattr(command, "stdout", PlainConsole(highlight=False, markup=False, width=80))
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
    from compare.report.provenance import describe_solver, list_described_names

    for name in list_described_names():
        found = describe_solver(name)
        assert found.title and all(setting.meaning for setting in found.settings), name
    (swarm,) = as_json("list", "pso")["algorithms"]
    assert {"name": "inertia_damping", "default": "0.99"}.items() <= swarm["settings"][2].items()
    assert "Kennedy, Eberhart (1995)" in swarm["source"]


@pytest.fixture(scope="module")
def solution() -> nlp_gait.Solution:
    """A solution of 30 variables with 50 active constraints, made from one of two."""
    solved = nlp_gait.solve(toy(corner, limit=1.5))
    variables = tuple(replace(solved.problem.variables[0], name=f"x{k}") for k in range(30))
    problem = replace(solved.problem, variables=variables)
    prices = tuple(
        ActiveConstraint(name=f"row{k}", side="lower", bound=0.0, unit="m", price=50.0 - k, price_unit="J per m")
        for k in range(50)
    )
    best = replace(solved.best, x=np.linspace(-1.0, 2.0, 30))
    return replace(solved, problem=problem, starts=(best,), active_constraints=prices)


def test_a_large_solution_is_shortened_largest_first(solution: nlp_gait.Solution) -> None:
    parts = list(solve._describe(solution))
    x, constraints = (part for part in parts if isinstance(part, Rows))
    assert [row[0] for row in x.rows[:3]] == ["x29", "x28", "x27"] and "largest" in x.title
    assert [row[0] for row in constraints.rows] == [f"row{k}" for k in range(8)]
    assert "and 18 more variables and 42 more active constraints: --out FILE or --json" in parts
    # A table has its title, two lines above and one below its rows, and its header and rule.
    lines = sum(len(part.rows) + 5 if isinstance(part, Rows) else 1 for part in parts)
    assert lines + 5 <= 40  # with what is known about the optimum, and the file that was written
