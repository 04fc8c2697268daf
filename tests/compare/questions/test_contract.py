"""What every question keeps: files that agree, a rerun that repeats no step, an interrupt that loses none."""

import csv
import json
import math
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import compare.questions
from compare.questions import certainty
from compare.questions.certainty import Certainty
from compare.questions.pareto.pareto import Pareto
from compare.questions.prices import Prices
from compare.questions.question import Answer, Question, Work, find
from compare.questions.sweep import Sweep, parse_axis
from compare.report.document import Table
from compare.study.memo import Memo
from nlp_gait import load
from nlp_gait.files import replace_nan
from tests.compare.cli.calls import as_json, nlp_gait

pytestmark = pytest.mark.usefixtures("coarse_pictures")

TIMES = ("time_s", "cpu_s", "run_time_s", "files")
BEAM = f"{Path(__file__).parents[3] / 'examples' / 'welded_beam.py'}:beam"
LEGS = {"hip_height_m": 0.31, "hip_vz_start_m_s": 0.007, "hip_vz_end_m_s": 0.0}
LEGS |= {"hip_vx_start_m_s": 0.005, "hip_vx_end_m_s": 0.068}


@dataclass(frozen=True, kw_only=True)
class Case:
    """A small question, the command that asks it, and the name in its answer of the rows of its CSV file; both may be empty."""

    make: Callable[[], Question[Any]]
    rows: str = ""
    line: Sequence[str] = ()


CASES = {
    "sweep": Case(
        make=lambda: Sweep(problem=load("walk12"), starts=1, axes=[parse_axis("step_length_m=0.08,0.1")]),
        rows="points",
        line="sweep walk12 --over step_length_m=0.08,0.1 --starts 1".split(),
    ),
    "certainty": Case(
        make=lambda: Certainty(problem=load("walk12"), starts=4, time_limit_s=0.0),
        line="certainty walk12 --starts 4 --time-limit 0".split(),
    ),
    "prices": Case(
        make=lambda: Prices(problem=load(BEAM), starts=2), rows="limits", line=["prices", BEAM, "--starts", "2"]
    ),
    "pareto": Case(
        make=lambda: Pareto(
            problem=load("nao-dsp", intervals=2).fix(**LEGS), points=5, starts=1, searches={"NSGA2": (100,)}, runs=1
        ),
        rows="front",
        line=[
            *"pareto nao-dsp --set intervals=2 --points 5 --starts 1 --search NSGA2=100 --runs 1".split(),
            *(f"--set={name}={value}" for name, value in LEGS.items()),
        ],
    ),
}
each_question = pytest.mark.parametrize("name", CASES)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the stored steps of all questions."""
    return tmp_path_factory.mktemp("questions")


def answer(question: Question[Any], memo: Memo) -> Answer:
    return question.add_best_known(find(question, Work(memo=memo)))


def without_times(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key not in TIMES}
    return [without_times(item) for item in data] if isinstance(data, list) else data


def test_every_question_is_here() -> None:
    """But one, whose smallest answer takes minutes of simulation."""
    paths = Path(compare.questions.__file__).parent.rglob("*.py")
    names = {path.stem for path in paths if "(Question[" in path.read_text(encoding="utf-8")}
    assert names - {"tune"} == {case.make().name for case in CASES.values()}


def price_walk() -> Prices:
    return Prices(problem=load("walk12"), starts=2)  # of the beam no step is stored


@pytest.mark.parametrize("make", [CASES["certainty"].make, price_walk, CASES["pareto"].make])
def test_an_interrupted_question_continues_to_the_same_answer(
    make: Callable[[], Question[Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certainty, "BATCH", 2)
    whole = answer(make(), Memo(tmp_path / "whole"))
    stored = sorted((tmp_path / "whole" / "store").iterdir(), key=lambda path: path.stat().st_mtime_ns)
    steps = {path.name for path in stored}
    assert steps
    (tmp_path / "store").mkdir()
    for path in stored[: len(steps) // 2 - 1]:  # by an earlier call
        shutil.copy2(path, tmp_path / "store")

    class Interrupting(Memo):
        """A memo with Ctrl-C after half of the steps."""

        def compute_all(self, *arguments: Any, **named: Any) -> dict[str, Any]:
            values = super().compute_all(*arguments, **named)
            if len(list((tmp_path / "store").iterdir())) == max(1, len(steps) // 2):
                raise KeyboardInterrupt
            return values

    with pytest.raises(KeyboardInterrupt):
        answer(make(), Interrupting(tmp_path))
    half = {path: path.stat().st_mtime_ns for path in (tmp_path / "store").iterdir()}
    assert 0 < len(half) <= len(steps)
    resumed = answer(make(), Memo(tmp_path))
    assert without_times(replace_nan(resumed.data)) == without_times(replace_nan(whole.data))
    assert {path.name for path in (tmp_path / "store").iterdir()} == steps
    assert {path: path.stat().st_mtime_ns for path in half} == half  # none is computed again


@pytest.mark.commit
@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.line])
def test_its_command_prints_the_answer(name: str, folder: Path) -> None:
    printed = as_json(*CASES[name].line, "--out", folder / name)
    assert all(Path(file).stat().st_size > 0 for file in printed["files"])
    assert without_times(printed) == without_times(
        json.loads(json.dumps(replace_nan(answer(CASES[name].make(), Memo(folder / name)).data)))
    )
    assert "wrote " in nlp_gait(*CASES[name].line, "--out", folder / name).stdout


@each_question
def test_files_agree_with_the_answer(name: str, folder: Path, tmp_path: Path) -> None:
    result = answer(CASES[name].make(), Memo(folder / name))
    written = result.write(tmp_path)
    assert {path.name for path in written} == {path.name for path in tmp_path.iterdir()}
    data = json.loads((tmp_path / f"{result.stem}.json").read_text())
    assert data == json.loads(json.dumps(replace_nan(result.data)))
    assert "best_known" in data and data["problem"] == CASES[name].make().problem.name
    page = (tmp_path / f"{result.stem}.md").read_text().replace("\\", "")  # Markdown's escapes
    assert f"# {result.title}" in page and all(sentence[:20] in page for sentence in result.headline)
    for table in (part for part in result.parts if isinstance(part, Table) and part.name):
        rows = list(csv.DictReader((tmp_path / f"{table.name}.csv").read_text().splitlines()))
        assert len(rows) == len(table.rows)
        for row, item in zip(rows, data[CASES[name].rows] if CASES[name].rows else (), strict=False):
            for key, text in row.items():
                value = item.get(key)
                if isinstance(value, float | int) and not isinstance(value, bool):
                    assert float(text) == value or math.isinf(float(text))
    assert all(path.stat().st_size > 0 for path in written if path.suffix != ".svg")
