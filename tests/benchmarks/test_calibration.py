"""Random feasible gaits against the engine."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

import nlp_gait  # noqa: E402
from benchmarks.calibration import calibrate, random_gait, shortest_true_s  # noqa: E402
from compare.judge import evaluate  # noqa: E402
from nlp_gait.errors import InputError  # noqa: E402


@pytest.mark.slow
def test_gaits_are_feasible_seeded_and_go_from_slow_to_fast():
    problem = nlp_gait.load("nao-dsp")
    cases = list(calibrate(problem, shortest_s=1.0, count=2, seed=3))
    assert [case.duration_s for case in cases] == pytest.approx([2.0, 1.0])
    for case in cases:
        assert case.result.x[-1] == pytest.approx(case.duration_s)
        assert evaluate(problem, case.result.x).feasible
        assert case.smooth.power_error != case.measurements.power_error
        assert abs(case.smooth.power_error) < 0.3
    again = random_gait(problem, "double_support_time_s", 2.0, np.random.default_rng(3))
    np.testing.assert_array_equal(again.x, cases[0].result.x)


def test_a_duration_without_feasible_gaits_is_an_error(monkeypatch):
    monkeypatch.setattr("benchmarks.calibration.DRAWS", 1)
    with pytest.raises(InputError, match=r"none of 2000 .* double_support_time_s = 0.2"):
        random_gait(nlp_gait.load("nao-dsp"), "double_support_time_s", 0.2, np.random.default_rng(0))


def test_the_model_holds_down_to_the_first_failure():
    class Run:
        def __init__(self, power_error, fallen=False):
            self.power_error, self.fallen = power_error, fallen

    runs = [(0.5, Run(0.01)), (4.0, Run(-0.05)), (2.0, Run(0.09)), (1.0, Run(0.5))]
    assert shortest_true_s(runs, 0.1) == 2.0
    assert shortest_true_s(runs, 0.6) == 0.5
    assert shortest_true_s(runs, 0.01) is None
    assert shortest_true_s([(4.0, Run(0.0)), (3.0, Run(0.0, fallen=True))], 0.1) == 4.0
