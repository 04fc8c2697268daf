"""The report shows the gaits themselves, or says why it does not."""

from dataclasses import replace

import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.drawing.gait_figure import draw_gaits, make_gait_charts
from compare.report.study_sections import load_gaits
from tests.compare.records import DSP_X, record


def comparison(name: str, x: dict[str, float], *solvers: str) -> Comparison:
    records = [record(solver, 0, [(1, 0.5)], problem="dsp") for solver in solvers]
    stored = {"name": name, "options": {}, "parameters": {}}
    changed = [replace(r, x=x, inputs=replace(r.inputs, problem=stored)) for r in records]
    return compare_problems(changed)[0]


def test_the_best_gait_is_drawn_with_curves_of_all() -> None:
    gaits = load_gaits(comparison("nao-dsp", DSP_X, "pso", "ga"))
    assert not isinstance(gaits, str)
    charts = make_gait_charts(gaits)
    assert [len(chart.series) for chart in charts] == [2, 2]
    assert [chart.y for chart in charts] == ["mechanical power [W]", "balance margin [mm]"]
    (poses,) = draw_gaits(gaits, curves=False)
    assert all(f">{words}</text>" in poses.to_svg() for words in ("left leg", "right leg"))


@pytest.mark.parametrize(
    ("name", "x", "why"),
    [
        ("nao-dsp", {"a": 1.0}, "must name every variable once"),
        ("never.py:seen", {"a": 1.0}, "never.py"),
    ],
)
def test_what_cannot_be_drawn_is_reported(name: str, x: dict[str, float], why: str) -> None:
    """Code that a record names is not run for it."""
    part = load_gaits(comparison(name, x, "pso"))
    assert isinstance(part, str) and part.startswith("The gaits are not drawn: ") and why in part
