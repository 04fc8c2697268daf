"""The report shows the gaits themselves, or says why it does not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.drawing.gait_figure import CURVES
from compare.report.document import Figure
from compare.report.problem_section import make_gaits_part
from tests.compare.records import DSP_X, record, study


def comparison(name: str, x: dict[str, float], *solvers: str) -> Comparison:
    records = [record(solver, 0, [(1, 0.5)], problem="dsp") for solver in solvers]
    stored = {"name": name, "options": {}, "parameters": {}, "sha256": ""}
    changed = [replace(r, x=x, definition={**r.definition, "problem": stored}) for r in records]
    return compare_problems(changed)[0]


@pytest.mark.slow
def test_best_gait_of_each_solver_is_drawn() -> None:
    part = make_gaits_part(comparison("nao-dsp", DSP_X, "pso", "ga"))
    assert isinstance(part, Figure) and part.name == "dsp-gaits"
    axes = part.drawing.axes
    assert {axis.get_title() for axis in axes} >= {"pso", "ga"}
    assert [len(axis.lines) for axis in axes if axis.get_ylabel() in CURVES.values()] == [2, 2]


@pytest.mark.parametrize(
    ("name", "x", "why"),
    [
        ("nao-dsp", {"a": 1.0}, "must name every variable once"),
        ("never.py:seen", {"a": 1.0}, "never.py"),
    ],
)
def test_what_cannot_be_drawn_is_reported(name: str, x: dict[str, float], why: str) -> None:
    """Code that a record names is not run for it."""
    part = make_gaits_part(comparison(name, x, "pso"))
    assert isinstance(part, str) and part.startswith("The gaits are not drawn: ") and why in part


def test_an_unknown_problem_does_not_fail_the_report() -> None:
    assert "unknown problem 'walk'" in str(make_gaits_part(compare_problems(study())[0]))
