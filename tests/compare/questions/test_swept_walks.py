"""Sweeps of walking cycles: cost of transport, and results that can be simulated."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare.questions.question import Work, find
from compare.questions.sweep import Sweep, parse_axis, plot_sweep
from compare.questions.swept_walks import SweepPoint
from compare.report.document import Figure
from compare.study.memo import Memo
from nlp_gait import load
from nlp_gait.formulation import load_result

pytestmark = pytest.mark.usefixtures("coarse_pictures")

# Fewer samples than those of ten intervals: the tests are about what is done with the gaits.
OVER = "speed_m_s=0.04,0.045"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with stored solves of the gaits."""
    return tmp_path_factory.mktemp("walk")


@pytest.fixture(scope="module")
def question() -> Sweep:
    problem = load("nao-cycle", objective="power", intervals=2)
    return Sweep(problem=problem, axes=[parse_axis(OVER)], starts=1)


@pytest.fixture(scope="module")
def points(question: Sweep, folder: Path) -> list[SweepPoint]:
    """Two gaits, and a point without one."""
    found = find(question, Work(memo=Memo(folder)))
    lost = replace(found[1], at={"speed_m_s": 1.0}, feasible=False, status="in the way: step_length")
    return [*found, lost]


def test_gaits_satisfy_the_axis(points: list[SweepPoint]) -> None:
    assert [point.feasible for point in points] == [True, True, False]
    for point in points[:2]:
        assert point.indexes["speed_m_s"] == pytest.approx(point.at["speed_m_s"])
        assert point.indexes["power_W"] == pytest.approx(point.objective)
        cost = point.objective / (5.30535 * 9.8 * point.at["speed_m_s"])
        assert point.indexes["cost_of_transport"] == pytest.approx(cost)


def test_the_table_and_the_results_can_be_read_back(question: Sweep, points: list[SweepPoint], tmp_path: Path) -> None:
    answer = question.report(points)
    assert [part.name for part in answer.parts if isinstance(part, Figure)][-1] == "nao-cycle-cost"
    answer.write(tmp_path)
    rows = list(csv.DictReader((tmp_path / "nao-cycle-sweep-speed_m_s-ipopt.csv").read_text().splitlines()))
    assert [float(row["at.speed_m_s"]) for row in rows] == [0.04, 0.045, 1.0]
    assert rows[2]["feasible"] == "false" and float(rows[0]["indexes.step_length_m"]) > 0.0
    assert not (tmp_path / "nao-cycle-speed_m_s-1.json").exists()
    axes = plot_sweep(points, question.problem).axes[0]
    line, cross = axes.lines
    assert np.isnan(line.get_ydata()).tolist() == [False, False, True] and list(cross.get_xdata()) == [1.0]
    assert axes.get_xlabel() == "speed [m/s]" and axes.get_ylabel() == "least power [W]"
    for point in points[:2]:
        speed = point.at["speed_m_s"]
        result = load_result(tmp_path / f"nao-cycle-speed_m_s-{speed:g}.json")
        assert result.problem.value("speed_m_s") == speed
        assert result.problem.by_name(result.x) == point.x
