"""Sweeps: axes, true curves, tables and pictures."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare.questions.question import Work, find
from compare.questions.sweep import MOST_POINTS, Axis, Sweep, parse_axis, plot_sweep
from compare.report.document import Table
from nlp_gait import load
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import load_result

pytestmark = pytest.mark.usefixtures("coarse_pictures")

# Verified with two independent implementations to five digits, except 0.8 s: 2.282582 W by IPOPT and by differential evolution.
SWING_W = {0.015: 0.84587, 0.022: 0.86616, 0.028: 0.88497}
AGREEMENT_W = 1e-4


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("swing_height_m=0.015:0.028:3", (0.015, 0.0215, 0.028)),
        ("swing_height_m=0.015:0.028:1", (0.015,)),
        ("swing_height_m=0.02,0.015", (0.02, 0.015)),
        ("swing_height_m=0.02", (0.02,)),
    ],
)
def test_axis(text: str, values: tuple[float, ...]) -> None:
    axis = parse_axis(text)
    assert axis.name == "swing_height_m"
    assert axis.values == pytest.approx(values)


@pytest.mark.parametrize("text", ["", "a", "a=", "=1", "a=1:2", "a=1:2:0", "a=1:2:x", "a=nan", "a=1,inf", "a=1:2:3:4"])
def test_what_is_not_an_axis_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="NAME=LOW:HIGH:COUNT"):
        parse_axis(text)


def test_true_price_of_a_higher_swing_foot() -> None:
    axis = Axis(name="swing_height_m", values=tuple(SWING_W))
    points = find(Sweep(problem=load("nao-ssp"), axes=[axis], starts=1))
    assert {p.at["swing_height_m"]: p.objective for p in points} == pytest.approx(SWING_W, abs=AGREEMENT_W)
    assert all(p.feasible and p.x["swing_height_m"] == p.at["swing_height_m"] for p in points)


def test_optima_stand_next_to_the_shipped_values_of_their_settings() -> None:
    axis = Axis(name="lambda", values=(0.33, 0.4))
    question = Sweep(problem=load("walk12"), axes=[axis], starts=1)
    table = next(part for part in question.report(find(question)).parts if isinstance(part, Table))
    assert [row[-1] for row in table.rows] == ["-", "0.922228 (shipped, proven to six digits)"]


def test_grid_of_two_axes() -> None:
    axes = [Axis(name="step_length_m", values=(0.08, 0.1)), Axis(name="lambda", values=(0.2, 0.3))]
    calls: list[str] = []
    question = Sweep(problem=load("walk12"), axes=axes, starts=1)
    points = find(question, Work(progress=calls.append))
    assert len(calls) == question.total and len(points) == 4
    assert [tuple(p.at.values()) for p in points] == [(0.08, 0.2), (0.08, 0.3), (0.1, 0.2), (0.1, 0.3)]
    assert [p.x["step_length_m"] for p in points] == [0.08, 0.08, 0.1, 0.1]


def test_errors_come_before_the_work() -> None:
    problem = load("nao-ssp")
    with pytest.raises(UnknownNameError, match="swing_height_m"):
        Sweep(problem=problem, axes=[Axis(name="swing_heigth_m", values=(0.02,))])
    with pytest.raises(InputError, match="bounds"):
        Sweep(problem=problem, axes=[Axis(name="swing_height_m", values=(0.02, 0.2))])
    with pytest.raises(InputError, match="once"):
        Sweep(problem=problem, axes=[Axis(name="swing_height_m", values=(0.02,))] * 2)


def test_gaits_of_a_walking_cycle_are_drawn_and_can_be_simulated(tmp_path: Path) -> None:
    """Few samples, and a second point without a gait."""
    problem = load("nao-cycle", objective="power", intervals=2)
    question = Sweep(problem=problem, axes=[parse_axis("speed_m_s=0.04")], starts=1)
    (point,) = find(question)
    assert point.feasible and point.metrics["speed_m_s"] == pytest.approx(0.04)
    assert point.metrics["cost_of_transport"] == pytest.approx(point.objective / (5.30535 * 9.8 * 0.04))
    lost = replace(point, at={"speed_m_s": 1.0}, feasible=False, status="in the way: step_length")
    question.report([point, lost]).write(tmp_path)
    rows = list(csv.DictReader((tmp_path / "nao-cycle-sweep-speed_m_s-ipopt.csv").read_text().splitlines()))
    assert [float(row["at.speed_m_s"]) for row in rows] == [0.04, 1.0]
    assert rows[1]["feasible"] == "false" and float(rows[0]["metrics.step_length_m"]) > 0.0
    assert not (tmp_path / "nao-cycle-speed_m_s-1.json").exists()
    result = load_result(tmp_path / "nao-cycle-speed_m_s-0.04.json")
    assert result.problem.value("speed_m_s") == 0.04 and result.problem.by_name(result.x) == point.x
    axes = plot_sweep([point, lost], problem).axes[0]
    line, cross = axes.lines
    assert np.isnan(line.get_ydata()).tolist() == [False, True] and list(cross.get_xdata()) == [1.0]
    assert axes.get_xlabel() == "speed [m/s]" and axes.get_ylabel() == "least power [W]"


def test_a_sweep_is_as_large_as_its_grid() -> None:
    axes = [parse_axis(f"{name}=0.05:0.13:101") for name in ("step_length_m", "frontal_shift_m")]
    expected = rf"at most {MOST_POINTS} points in all, got 101 of step_length_m x 101 of frontal_shift_m = 10201"
    with pytest.raises(InputError, match=expected):
        Sweep(problem=load("walk12"), axes=axes)
