"""The textbook's walk: preview control against least squares, and the cycle that comes of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, sample_finely
from nlp_gait.gaits.biped.cart_table import (
    JERK_WEIGHT,
    Footsteps,
    Walker,
    count_preview,
    follow_zmp,
    plan_cart_table_walk,
)
from nlp_gait.gaits.nao.body import GRAVITY, load_nao
from nlp_gait.gaits.nao.problems import make_nao_cycles

STEPS = Footsteps(step_m=0.05, single_s=0.6, double_s=0.4, hip_height_m=0.3, lift_m=0.015)


def histories(gait: Result) -> dict[str, Array]:
    return dict(sample_finely(gait).arrays)


def walker() -> Walker:
    return Walker(cycles=make_nao_cycles(), footsteps=STEPS)


@pytest.mark.slow
def test_preview_control_is_the_least_squares_optimum() -> None:
    """The gains come from a Riccati equation; the same cost over a long horizon is a linear least squares problem."""
    count, t = 300, 0.02
    reference = np.zeros(count + count_preview(t))
    reference[100:], reference[160:] = 0.05, 0.12
    course = follow_zmp(reference, t, 0.26, GRAVITY)
    step = np.array([[1.0, t, t**2 / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    push, output = np.array([t**3 / 6, t**2 / 2, t]), np.array([1.0, 0.0, -0.26 / GRAVITY])
    response, state = np.zeros(count), push
    for k in range(1, count):
        response[k], state = output @ state, step @ state
    zmp = toeplitz(response, np.zeros(count))
    changes = np.eye(count) - np.eye(count, k=-1)
    jerks = np.linalg.lstsq(
        np.vstack([zmp, np.sqrt(JERK_WEIGHT) * changes]),
        np.concatenate([reference[:count], np.zeros(count)]),
        rcond=None,
    )[0]
    # The controller looks 1.6 s ahead, the least squares to the end.
    assert np.abs(6 * course.c[0, :200] - jerks[:200]).max() < 1e-3 * np.abs(jerks).max()


def test_a_course_is_exact_between_its_samples() -> None:
    course = follow_zmp(np.linspace(0.0, 0.1, 50 + count_preview(0.02)), 0.02, 0.26, GRAVITY)
    assert [course(0.0, order) for order in range(3)] == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    before, after = course(0.02 * np.arange(1, 50) - 1e-9), course(0.02 * np.arange(1, 50))
    assert before == pytest.approx(after, abs=1e-9)


def test_the_planned_zmp_goes_from_the_middle_of_one_sole_to_that_of_its_mirror_image() -> None:
    first, last = walker().plan_zmp(np.array([0.0, STEPS.period_s])).T
    assert last == pytest.approx(first * (1, -1) + (STEPS.step_m, 0), abs=1e-12)
    robot = load_nao("nao-v5")
    foot, ankle = robot.feet["left"], robot.joint("LHipYawPitch").origin_m[1]
    assert -foot.back_m < first[0] < foot.front_m
    assert first[1] - ankle == pytest.approx(foot.left_m - (first[1] - ankle) - foot.right_m, abs=1e-12)
    # Every 5 ms, and at the switch.
    assert len(walker().times) == 201 and walker().times[120] == STEPS.single_s


# Root mean square distance of the whole body's ZMP from the planned one in x and y, without the second pass (measured).
FIRST_PASS_M = np.array([0.0042, 0.0082])


@pytest.fixture(scope="module")
def gait() -> Result:
    return plan_cart_table_walk(make_nao_cycles(), STEPS)


@pytest.mark.slow
def test_the_whole_bodys_zmp_is_near_the_planned_one(gait: Result) -> None:
    arrays = histories(gait)
    error = np.sqrt(np.mean((arrays["zmp"].T - walker().plan_zmp(arrays["t"])) ** 2, axis=1))
    assert (error < 0.3 * FIRST_PASS_M).all()


@pytest.mark.slow
def test_the_cycle_is_one_step_and_continues_mirrored(gait: Result) -> None:
    hip = histories(gait)["hip"]
    assert gait.problem.name == "recorded-cycle" and gait.x == pytest.approx((0.6, 0.4, 0.05), abs=1e-12)
    assert hip[-1] == pytest.approx(hip[0] * (1, -1, 1) + (0.05, 0, 0), abs=1e-9)
    assert hip[:, 2] == pytest.approx(0.3, abs=1e-6)
    assert gait.problem.display.simulation_model is not None and gait.problem.display.simulation_model.repeats


@pytest.mark.slow
def test_another_robot_walks_on_its_own_legs() -> None:
    gait = plan_cart_table_walk(make_nao_cycles("nao-v6", 2), STEPS)
    assert gait.problem.options["robot"] == "nao-v6" and gait.problem.display.robot is not None
    assert gait.problem.display.robot.name == load_nao("nao-v6").name


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"hip_height_m": 0.33},
            "a hip 0.33 m high reaches no step of 0.05 m: .* the right ankle is too far; lower the hip",
        ),
        ({"hip_height_m": 0.335, "step_m": 0.01}, "the left ankle is too far; lower the hip"),
        ({"single_s": 0.0}, "single_s must be a finite number > 0, got 0.0"),
        ({"step_m": float("nan")}, "step_m must be a finite number > 0, got nan"),
    ],
)
def test_footsteps_that_are_no_walk_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        plan_cart_table_walk(make_nao_cycles(), Footsteps(**{**vars(STEPS), **change}))
