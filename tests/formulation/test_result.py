"""Files with a gait."""

import json

import numpy as np
import pytest

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import load_result, sample_signals

X = dict(
    zip(
        nlp_gait.load("nao-dsp").names,
        (0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 2.0),
        strict=True,
    )
)


def written(tmp_path, data):
    path = tmp_path / "result.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return path


def test_a_few_lines_by_hand_are_enough(tmp_path):
    stated = {"problem": "nao-dsp", "options": {"robot": "nao-v6"}, "x": dict(reversed(X.items())), "status": "ignored"}
    result = load_result(written(tmp_path, stated))
    assert result.problem.name == "nao-dsp" and result.problem.options["robot"] == "nao-v6"
    np.testing.assert_array_equal(result.x, list(X.values()))


def test_a_solution_is_read_with_its_options_and_parameters(tmp_path):
    problem = nlp_gait.load("nao-dsp", robot="nao-v6", torso_share="lever").with_values(torque_change_limit_Nm=1.1)
    solution = nlp_gait.solve(problem, starts=1, seed=0)
    result = load_result(written(tmp_path, solution.to_json()))
    assert result.problem.options["torso_share"] == "lever" and result.problem.options["robot"] == "nao-v6"
    assert result.problem.value("torque_change_limit_Nm") == 1.1
    np.testing.assert_array_equal(result.x, list(solution.x.values()))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("{", "is not valid JSON"),
        ({"x": X}, "problem is missing"),
        ({"problem": "nao-dps", "x": X}, "unknown problem 'nao-dps'; did you mean 'nao-dsp'"),
        (
            {"problem": "nao-dsp", "x": {k: v for k, v in X.items() if k != "hip_height_m"}},
            "must name every variable once; missing: hip_height_m",
        ),
        ({"problem": "nao-dsp", "x": {**X, "hip_height_m": "tall"}}, "hip_height_m must be a number, got 'tall'"),
        ({"problem": "nao-dsp", "x": {**X, "hip_height_m": float("nan")}}, "hip_height_m' must be finite, got nan"),
        ({"problem": "nao-dsp", "x": X, "paramters": {}}, "unknown key 'paramters'; did you mean 'parameters'"),
        ({"problem": "nao-dsp", "x": X, "robot": "nao-v4"}, "write it into 'options'"),
    ],
)
def test_damaged_files_are_refused_by_name(tmp_path, data, words):
    with pytest.raises(InputError, match="result.json") as caught:
        load_result(written(tmp_path, data))
    assert words in str(caught.value)


@pytest.mark.parametrize(("period", "samples"), [(0.2, 11), (0.1, 21), (0.15, 21), (10.0, 11)])
def test_sampling_keeps_the_problems_samples(tmp_path, period, samples):
    result = load_result(written(tmp_path, {"problem": "nao-dsp", "x": X}))
    signals = sample_signals(result, period)
    assert len(signals.arrays["t"]) == samples
    own = result.problem.signals(result.x)
    np.testing.assert_allclose(signals.arrays["q"][:: (samples - 1) // 10], own.arrays["q"], atol=1e-12)


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan")])
def test_a_period_that_is_not_positive_is_refused(tmp_path, period):
    with pytest.raises(InputError, match="must be > 0 s"):
        sample_signals(load_result(written(tmp_path, {"problem": "nao-dsp", "x": X})), period)
