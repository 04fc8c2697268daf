"""A phase is evaluated once at its samples, whatever its limits read: the exact function maps one function for each phase."""

from dataclasses import replace
from typing import Any

import casadi as ca
import pytest

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import GaitProblem, load


def count_maps(problem: GaitProblem) -> int:
    """Count the functions that are mapped over samples."""
    function = build_exact_model(problem).function
    calls = [
        function.instruction_MX(k).which_function()
        for k in range(function.n_instructions())
        if function.instruction_id(k) == ca.OP_CALL
    ]
    return sum(call.class_name() == "Map" for call in calls)


@pytest.mark.parametrize(
    "options",
    [
        {"motors": "limits,ankle,heat,free-braking"},
        {"objective": "torque-smoothness", "motors": "limits"},
        {"objective": "jerk", "motors": "limits,ankle", "trajectory": "quintic", "samples_per_interval": 1},
    ],
)
@pytest.mark.parametrize("name", ["nao-ssp", "nao-dsp"])
def test_one_call_for_a_phase(name: str, options: dict[str, Any]) -> None:
    assert count_maps(load(name, **options)) == 1


def test_two_calls_for_a_cycle() -> None:
    assert count_maps(load("nao-cycle")) == 2


def test_a_derived_problem_does_not_evaluate_its_phase_again() -> None:
    problem = load("nao-ssp", motors="limits").derive(
        change=lambda gait, point, ops: replace(gait, objective=gait.objective + point["single_support_time_s"])
    )
    assert count_maps(problem) == 1


def test_finite_differences_need_two() -> None:
    """Angles at all samples come first, then torques from their differences."""
    assert count_maps(load("nao-ssp", derivatives="finite-difference", motors="limits")) == 2
