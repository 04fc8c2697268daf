"""The report shows the gaits themselves, or says why it does not."""

from dataclasses import replace

import numpy as np
import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.drawing.gait_figure import draw_gaits, make_gait_charts, measure_deviation
from compare.report.study_sections import load_gaits
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import Limb, Skeleton
from tests.compare.records import DSP_X, record


def comparison(name: str, x: dict[str, float], *solvers: str) -> Comparison:
    records = [record(solver, 0, [(1, 0.5)], problem="dsp") for solver in solvers]
    stored = {"name": name, "options": {}, "parameters": {}}
    changed = [replace(r, x=x, inputs=replace(r.inputs, problem=stored)) for r in records]
    return compare_problems(changed)[0]


def test_the_best_gait_is_drawn_and_the_others_as_deviations_from_it() -> None:
    gaits = load_gaits(comparison("nao-dsp", DSP_X, "pso", "ga"))
    assert not isinstance(gaits, str)
    deviation, power, margin = charts = make_gait_charts(gaits)
    assert [len(chart.series) for chart in charts] == [1, 2, 2]
    assert [chart.y for chart in charts] == ["deviation [mm]", "mechanical power [W]", "balance margin [mm]"]
    assert abs(deviation.series[0].y).max() < 1e-9  # both have the same gait
    assert ">ga, and pso dashed</text>" in draw_gaits(gaits, curves=False).to_svg()


def test_a_gait_shifted_by_a_millimetre_deviates_by_a_millimetre_at_any_speed() -> None:
    def walk(t: Array, begin: float, factor: float, shift: float) -> Skeleton:
        ankle, hip = np.stack([t, 0.0 * t + shift, 1.0 - t], axis=1), np.stack([2.0 * t, t, 1.0 + t], axis=1)
        limb = Limb(side="left", points=np.stack([ankle, hip], axis=1))
        line = np.zeros((len(t), 2))
        return Skeleton(t=begin + factor * t, limbs=(limb,), soles=(), ground=line, com=hip, zmp=line)

    planned, slower = walk(np.linspace(0.0, 1.0, 11), 0.0, 1.0, 0.0), walk(np.linspace(0.0, 1.0, 26), 3.0, 2.0, 1e-3)
    np.testing.assert_allclose(measure_deviation(slower, planned), 1.0, rtol=1e-9)


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
