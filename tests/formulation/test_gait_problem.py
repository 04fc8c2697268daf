"""Every problem: parameters, bounds, fixed variables, names and messages."""

from typing import Any

import numpy as np
import pytest

from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import GaitProblem, load
from tests.backends.toys import corner, toy

HIP = [f"hip_v{axis}_{end}_m_s" for axis in "zxy" for end in ("start", "end")]


@pytest.mark.parametrize(
    ("name", "last", "lower", "upper", "limits"),
    [
        ("nao-ssp", ["swing_height_m", "single_support_time_s"], [0.015, 0.4], [0.03, 4.0], (0.05, 0.02)),
        ("nao-dsp", ["double_support_time_s"], [0.2], [2.0], (0.08, 0.08)),
    ],
)
def test_variables_bounds_and_limits_are_the_papers(
    name: str, last: list[str], lower: list[float], upper: list[float], limits: tuple[float, float]
) -> None:
    problem = load(name)
    assert problem.names == ("hip_height_m", *HIP, *last)
    assert problem.lower.tolist() == [0.25, -0.05, -0.05, 0.001, 0.001, -0.2, -0.2, *lower]
    assert problem.upper.tolist() == [0.31, 0.05, 0.05, 0.2, 0.2, 0.2, 0.2, *upper]
    margins = [f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy"]
    got = [problem.value(key) for key in ("torque_change_limit_Nm", *margins, "heat_loss_W_per_Nm2")]
    assert got == [1.2, 0.0, 0.0, *limits, 0.025]


def test_a_copy_with_other_values_shares_what_was_built_and_leaves_the_first_alone() -> None:
    def build(problem: GaitProblem, *kind: str) -> object:
        return object()

    problem = toy(corner)
    first = problem.build_once(build)
    assert problem.build_once(build, "another") is not first
    other = problem.with_values(**{"limit": 0.75, "x.upper": 1.5})
    assert other.build_once(build) is first
    assert (other.value("limit"), problem.value("limit")) == (0.75, 0.5)
    assert (other.upper[0], problem.upper[0]) == (1.5, 2.0)
    assert other.values == {"limit": 0.75, "x.upper": 1.5}
    assert other.with_values(limit=0.25).upper[0] == 1.5  # values add up
    assert toy(corner).build_once(build) is not first


def test_a_fixed_variable_has_equal_bounds() -> None:
    fixed = toy(corner).fix(x=0.25)
    assert (fixed.lower[0], fixed.upper[0]) == (0.25, 0.25)
    assert fixed.start_point(np.random.default_rng(0))[0] == 0.25


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"limit": float("nan")}, r"parameter 'limit' must be a finite number \[m\], got nan"),
        ({"limit": -10.0}, r"parameter 'limit' must be within \[-9\.0, inf\] m, got -10\.0"),
        ({"x.lower": 3.0}, r"bounds of 'x' are inverted: lower 3 is above upper 2; set x\.lower and x\.upper so that"),
    ],
)
def test_values_that_are_not_allowed_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        toy(corner).with_values(**values)


def test_unknown_names_get_the_nearest_ones() -> None:
    problem = load("nao-ssp")
    with pytest.raises(UnknownNameError, match="unknown option of nao-ssp 'robots'; did you mean 'robot'"):
        load("nao-ssp", robots="nao-v5")
    with pytest.raises(UnknownNameError, match="parameter of nao-ssp 'dbm_y_limit_m'; did you mean"):
        problem.with_values(dbm_y_limit_m=0.1)
    with pytest.raises(UnknownNameError, match="variable of nao-ssp 'swing_height'; did you mean 'swing_height_m'"):
        problem.fix(swing_height=0.02)


@pytest.mark.parametrize(
    ("x", "message"),
    [
        ([1.0], r"x of toy must have 2 values \(x, y\), got shape \(1,\)"),
        ([1.0, np.nan], "x of toy: y must be finite, got nan"),
        (["a", "b"], "x of toy must be numbers, got list"),
        ({"x": 1.0}, "x of toy must name every variable once; missing: y, unknown: none"),
        ({"x": 1.0, "y": 2.0, "z": 3.0}, "missing: none, unknown: z"),
    ],
)
def test_invalid_points_are_refused(x: Any, message: str) -> None:
    assert toy(corner).check_x({"y": 2.0, "x": 1.0}).tolist() == [1.0, 2.0]  # by name in any order
    for read in (toy(corner).check_x, toy(corner).at):
        with pytest.raises(InputError, match=message):
            read(x)


def test_parameter_arrays_cannot_be_written() -> None:
    problem = toy(corner)
    for array in (problem.p, problem.lower, problem.upper, problem.scale):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
