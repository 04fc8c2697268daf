"""User code is what was read when the study began: helpers never meet, edits are seen, and a change meanwhile ends the study."""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from compare.study.perform import ChangedFileError, judge_search, perform, run_search
from compare.study.run import ProblemSpec, Run, make_inputs
from compare.study.study import Study, run_study
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import load
from nlp_gait.user_code import load_object
from tests.compare.records import run_once

WALK = ProblemSpec(name="walk12")
PROBLEM = """
from sizes import SIZE
from nlp_gait.formulation import Assembly, GaitProblem, Objective, Variable

def assemble(point, ops):
    import later
    return Assembly(objective=(point["x"] - 1) ** 2 + SIZE + later.EXTRA, constraints=())

p = GaitProblem(name="p", title="p", variables=(Variable(name="x", unit="m", lower=0.0, upper=3.0),),
                objective=Objective(name="cost", unit="W"), assemble=assemble)
"""


def write(folder: Path, size: int) -> str:
    folder.mkdir(exist_ok=True)
    (folder / "p.py").write_text(PROBLEM)
    (folder / "sizes.py").write_text(f"SIZE = {size}\n")
    (folder / "later.py").write_text(f"EXTRA = {10 * size}\n")
    return f"{folder}/p.py:p"


def measure(name: str) -> float:
    problem = load(name)
    return build_exact_model(problem).at([1.0], problem.p).cost


def test_helpers_of_one_name_belong_to_their_file_and_edits_are_seen(tmp_path: Path) -> None:
    names = [write(tmp_path / f"v{size}", size) for size in (1, 2)]
    assert [measure(name) for name in (*names, names[0])] == [11.0, 22.0, 11.0]
    write(tmp_path / "v1", 3)
    assert [measure(name) for name in names] == [33.0, 22.0]
    assert "sizes" not in sys.modules


def test_a_folder_of_modules_is_imported_absolutely_and_relatively(tmp_path: Path) -> None:
    package = tmp_path / "parts"
    package.mkdir()
    (package / "__init__.py").write_text("from .one import ONE\n")
    (package / "one.py").write_text("from . import two\nfrom .two import TWO\nONE = TWO - 1\nassert two.TWO == TWO\n")
    (package / "two.py").write_text("import math\nTWO = math.floor(2.5)\n")
    (tmp_path / "own.py").write_text("import parts.one as one\nfrom parts import ONE\nSUM = ONE + one.TWO\n")
    assert load_object(f"{tmp_path}/own.py:SUM", "algorithm") == 3


def test_a_problem_with_random_numbers_is_refused_before_anything_runs(tmp_path: Path) -> None:
    name = write(tmp_path / "r", 1)
    (tmp_path / "r" / "sizes.py").write_text("import random\nSIZE = random.random()\n")
    with pytest.raises(InputError, match="two loads of the problem .* differ: fix the seed"):
        run_once(Run(problem=ProblemSpec(name=name), solver="random", evaluations=50))


@pytest.mark.parametrize("changed", ["own.py", "sizes.py"])
def test_a_file_that_changes_while_the_study_runs_ends_it(tmp_path: Path, changed: str) -> None:
    mark = tmp_path / "began"
    (tmp_path / "sizes.py").write_text("N = 1\n")
    (tmp_path / "own.py").write_text(
        "import pathlib, time, sizes\ndef search(f, lower, upper, evaluations, seed):\n"
        f" f(lower)\n pathlib.Path({str(mark)!r}).touch()\n time.sleep(0.2)\n"
    )

    def edit(record: object) -> None:
        assert mark.exists()
        (tmp_path / changed).write_text((tmp_path / changed).read_text() + "M = 2\n")
        time.sleep(0.1)

    runs = tuple(Run(problem=WALK, solver=f"{tmp_path}/own.py:search", number=k, evaluations=9) for k in (0, 1))
    with pytest.raises(
        InputError, match="has changed since the study began: .*; the 1 runs before it are stored: rerun"
    ):
        run_study(Study(runs=runs, folder=tmp_path / "study"), edit)
    records = run_study(Study(runs=runs, folder=tmp_path / "study"))
    assert len({record.inputs.code for record in records}) == 1


@pytest.mark.parametrize("edit", [lambda path: path.write_text("SIZE = 9\n"), Path.unlink], ids=["edited", "deleted"])
def test_no_run_is_solved_or_judged_as_a_problem_that_changed_meanwhile(
    tmp_path: Path, edit: Callable[[Path], object]
) -> None:
    problem = ProblemSpec(name=write(tmp_path, 1))
    runs = [Run(problem=problem, solver=name, evaluations=50) for name in ("random", "ipopt")]
    search, ipopt = make_inputs(runs)
    end = run_search(runs[0], search)
    edit(tmp_path / "sizes.py")
    for call in (lambda: judge_search(runs[0], search, end), lambda: perform(runs[1], ipopt)):
        with pytest.raises(ChangedFileError, match="a file has changed since the study began: "):
            call()
