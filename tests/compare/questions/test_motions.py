"""The comparison of motions: what is solved, that it rises nowhere, and that it continues."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from compare.cli import app
from compare.questions.motions import motion as module
from compare.questions.motions.motion import SolvedMotion, extrapolate, find_start, load_phase, make_tasks
from compare.questions.motions.motions import Motions, describe_motions
from compare.questions.question import Work, find
from compare.study.store import Store
from compare.study.task import ProblemSpec
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError

pytestmark = pytest.mark.usefixtures("coarse_pictures")

RUN = CliRunner()
ORDERS = ["cubic", "quintic"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("motions")


@pytest.fixture(scope="module")
def question() -> Motions:
    return Motions(problem=load_phase("nao-dsp", intervals=2), orders=ORDERS, free_orders=(), starts=0)


@pytest.fixture(scope="module")
def found(folder: Path, question: Motions) -> tuple[SolvedMotion, ...]:
    return find(question, Work(store=Store(folder)))


def test_a_quintic_needs_less_and_hides_power_between_few_samples(found: tuple[SolvedMotion, ...]) -> None:
    cubic, quintic, coarse = found
    assert all(motion.feasible for motion in found)
    assert quintic.power_W < 0.9 * cubic.power_W
    assert quintic.power_W == pytest.approx(quintic.dense_power_W, rel=0.15)
    assert coarse.power_W < 0.1 * coarse.dense_power_W and coarse.worst.startswith("torque_change")
    assert (cubic.coefficients, quintic.coefficients) == (0, 14)


def test_a_question_continues_from_its_files(
    folder: Path, question: Motions, found: tuple[SolvedMotion, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("solved again")

    monkeypatch.setattr(module, "solve", never)
    again: list[str] = []
    assert find(question, Work(store=Store(folder), progress=again.append)) == found
    assert again == ["planned-cubic-power", "planned-quintic-power", "coarse-quintic-power"]
    with pytest.raises(AssertionError, match="solved again"):
        find(replace(question, seed=1), Work(store=Store(folder)))


def test_table_pictures_and_command(folder: Path, found: tuple[SolvedMotion, ...]) -> None:
    command = [
        "motions",
        "nao-dsp",
        "--orders",
        "cubic,quintic",
        "--free-orders",
        "",
        "--starts",
        "0",
        "--intervals",
        "2",
    ]
    command += ["--out", str(folder)]
    done = RUN.invoke(app, [*command, "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert [motion["power_W"] for motion in result["motions"]] == [motion.power_W for motion in found]
    written = {Path(name).name: Path(name) for name in result["files"]}
    lines = list(csv.DictReader(written["nao-dsp-motions.csv"].read_text().splitlines()))
    assert [float(line["power_W"]) for line in lines] == [motion.power_W for motion in found]
    pictures = [path for path in written.values() if path.suffix in (".png", ".svg")]
    assert len(pictures) == 4 and all(picture.stat().st_size > 0 for picture in pictures)
    printed = RUN.invoke(app, command).stdout
    assert all(words in printed for words in ("3 samples: quintic", "never rises", "and violates torque_change"))


def test_a_leaning_torso_starts_from_the_plan_that_it_contains(found: tuple[SolvedMotion, ...]) -> None:
    *_, task = make_tasks("nao-dsp", orders=ORDERS, free_orders=["quintic"], intervals=2)
    problem = ProblemSpec(name=task.problem, options=task.options).load()
    planned = ProblemSpec(name="nao-dsp", options=task.options).load()
    x0 = find_start(task, problem, found)
    assert x0 is not None
    expected = build_exact_model(planned).at(np.array(list(found[1].x.values())), planned.p)
    assert build_exact_model(problem).at(x0, problem.p).cost == pytest.approx(expected.cost, rel=1e-9)


def test_a_rise_is_reported(question: Motions, found: tuple[SolvedMotion, ...]) -> None:
    cubic, quintic, coarse = found
    worse = replace(quintic, power_W=cubic.power_W + 0.01)
    assert "power rises by up to 0.01 W" in describe_motions([cubic, worse, coarse])[0]
    assert "-" in question.report((cubic, worse)).parts[0].rows[1][3]


@pytest.mark.parametrize("phase", ["nao-ssp", "nao-dsp"])
def test_a_study_adds_free_joints_and_smoothness(phase: str) -> None:
    study = make_tasks(phase, orders=["cubic", "spline-4"], free_orders=["spline-2"])
    assert [(task.kind, task.problem, task.trajectory) for task in study] == [
        ("planned", phase, "cubic"),
        ("planned", phase, "spline-4"),
        ("coarse", phase, "spline-4"),
        ("smooth", phase, "spline-4"),
        ("smooth", phase, "spline-4"),
        ("free", f"{phase}-free", "spline-2"),
    ]
    assert [task.options["samples_per_interval"] for task in study] == [4, 4, 1, 4, 4, 8]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"phase": "walk12"}, "compared for nao-ssp and nao-dsp, got 'walk12'"),
        ({"phase": "nao-ssp", "orders": ["quintic", "cubic"]}, "must rise and be among cubic, quintic"),
        ({"phase": "nao-ssp", "free_orders": ["septic"]}, "must rise and be among cubic, quintic"),
        ({"phase": "nao-ssp", "orders": []}, "at least one order"),
    ],
)
def test_other_studies_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_tasks(**arguments)


def test_the_limit_of_a_geometric_sequence_is_exact() -> None:
    assert extrapolate([3.0, 2.0, 1.5]) == pytest.approx(1.0)
    assert extrapolate([9.0, 3.0, 2.0, 1.5]) == pytest.approx(1.0)
    assert (
        extrapolate([3.0, 2.0, 1.0]) is None
        and extrapolate([3.0, 2.0]) is None
        and extrapolate([3.0, 2.0, 2.5]) is None
    )
    assert extrapolate([3.0, 2.0, 1.1]) is None  # would be 8.1 away, nine times as far as the last step
