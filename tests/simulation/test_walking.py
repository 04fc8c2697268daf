"""Walks of several steps: mirrored exactly, and in the engine."""

import numpy as np
import pytest

import nlp_gait
from nlp_gait.formulation import Array, Result, Signals, sample_finely
from nlp_gait.gaits.nao.body import GRAVITY, make_nao
from nlp_gait.gaits.several_steps import measure_step, repeat_steps
from nlp_gait.robots import load_robot
from tests.pinocchio_oracle import left_over

pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow  # each gait is simulated

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import measure_walk  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.simulate import simulate_plan  # noqa: E402

# Cheapest cycles at two speeds [m/s], in the same order without the step, which follows from speed and times.
SLOW = (0.006195, 0.029353, 0.31, 0.015317, 0.046576, -0.009914, 0.0, 0.0)
SLOW += (0.033941, 0.029151, 0.308712, 0.01054, -0.046196, 0.008558, 0.0, 0.0, 0.015, 0.4, 2.0)
FAST = (-0.001632, 0.017537, 0.31, 0.127409, 0.119005, -0.01045, 0.0, 0.0)
FAST += (0.046154, 0.020749, 0.308092, 0.108634, -0.063984, 0.024616, 0.0, 0.0, 0.015, 0.4, 0.400378)
# The cycle's own numbers are continuous to rounding, and so are those of a walk.
CONTINUITY = 1e-8
# Samples 1 ms apart and third derivatives of 1e3 rad/s^3: 1e-9 * 1e3 / 12, with a margin.
THIRD_ORDER = 1e-6
STEPS = 4


@pytest.fixture(scope="module")
def signals(cycle: Result) -> Signals:
    return sample_finely(cycle)


def jumps(values: Array, slopes: Array, t: Array) -> Array:
    """What a trapezoid of the slopes does not explain of each change: of third order in the time between samples."""
    return np.asarray(np.diff(values, axis=0) - np.diff(t)[:, None] * (slopes[1:] + slopes[:-1]) / 2)


def test_a_walk_has_no_jump_in_any_angle_or_position(signals: Signals) -> None:
    arrays = repeat_steps(signals, make_nao("nao-v5").robot, 4).arrays
    t = arrays["t"]
    assert (np.diff(t) > 0.0).all()
    assert t[-1] == pytest.approx(4 * signals.arrays["t"][-1])
    assert np.abs(jumps(arrays["q"], arrays["qd"], t)).max() < THIRD_ORDER
    for name in ("hip", "left_foot", "right_foot"):
        assert np.abs(np.diff(arrays[name], axis=0)).max() < 2e-3  # 0.4 m/s of a foot for 1 ms


def test_every_second_step_is_a_mirror_image_and_two_of_them_move_alike(signals: Signals) -> None:
    arrays = repeat_steps(signals, make_nao("nao-v5").robot, 3).arrays
    n, step = len(signals.arrays["t"]) - 1, measure_step(signals)
    assert step == pytest.approx(0.07619)
    np.testing.assert_allclose(arrays["q"][2 * n :], arrays["q"][: n + 1], atol=CONTINUITY)
    np.testing.assert_allclose(arrays["hip"][n : 2 * n + 1, 1], -arrays["hip"][: n + 1, 1], atol=CONTINUITY)
    np.testing.assert_allclose(arrays["left_foot"][-1] - arrays["left_foot"][0], (2 * step, 0, 0), atol=CONTINUITY)
    np.testing.assert_allclose(arrays["right_foot"][-1] - arrays["right_foot"][0], (4 * step, 0, 0), atol=CONTINUITY)


def test_wrenches_carry_the_robot_in_mirrored_steps_too(signals: Signals) -> None:
    """Pinocchio finds nothing left over in either phase of the second and the third step."""
    walked = repeat_steps(signals, make_nao("nao-v5").robot, 3)
    n = len(signals.arrays["t"]) - 1
    for sample in (n + n // 4, n + n // 2, 2 * n - n // 8, 2 * n + n // 2, 3 * n - n // 8):
        loads = [walked.arrays[f"{side}_force"][sample, 2] for side in ("left", "right")]
        rest = left_over(load_robot("nao-v5"), walked, sample, GRAVITY, stance=("L", "R")[int(np.argmax(loads))])
        np.testing.assert_allclose(rest, 0.0, rtol=0, atol=1e-4)  # NAO is not quite its own mirror image


def test_several_steps_are_walked_without_a_fall(cycle: Result) -> None:
    plan = make_plan(cycle, STEPS)
    trace = simulate_plan(plan)
    found = measure_walk(plan, trace, Drive(), STEPS)
    assert trace.t[-1] == pytest.approx(plan.duration_s + 1.0, abs=0.002)
    assert not found.measurements.fallen and found.steps_done == STEPS
    assert found.planned_m == pytest.approx(STEPS * 0.07619)
    assert found.walked_m is not None and found.drift_m is not None and found.heading_deg is not None
    assert 0.99 * found.planned_m < found.walked_m < found.planned_m
    assert abs(found.drift_m) < 0.005 and abs(found.heading_deg) < 1.0
    assert found.measurements.largest_tilt_deg < 2.0
    assert 0.0 < found.measurements.slip_m < 0.003
    assert found.model_J_per_m == pytest.approx(19.15, rel=0.01)
    assert found.engine_J_per_planned_m == pytest.approx(found.model_J_per_m, rel=0.02)


@pytest.mark.parametrize(("speed_m_s", "x", "planned_J_per_m"), [(0.03, SLOW, 20.75), (0.1, FAST, 19.12)])
def test_at_any_speed_the_engine_needs_the_planned_energy(
    speed_m_s: float, x: tuple[float, ...], planned_J_per_m: float
) -> None:
    problem = nlp_gait.load("nao-cycle", objective="power").with_values(speed_m_s=speed_m_s)
    plan = make_plan(Result(problem=problem, x=problem.check_x(x)), 2)
    found = measure_walk(plan, simulate_plan(plan), Drive(), 2)
    assert found.model_J_per_m == pytest.approx(planned_J_per_m, rel=0.001)
    assert found.engine_J_per_planned_m == pytest.approx(found.model_J_per_m, rel=0.02)
    assert found.walked_m is not None and found.walked_m > 0.99 * found.planned_m


def test_feet_stand_when_they_are_planned_to(cycle: Result) -> None:
    plan = make_plan(cycle, 2)
    times = np.array([0.2, 0.6, 0.9, 0.97 + 0.2, 0.97 + 0.6])  # swing, both, both, swing, both
    assert plan.supports == ()
    assert plan.stands("left", times).tolist() == [1, 1, 1, 0, 1]
    assert plan.stands("right", times).tolist() == [0, 1, 1, 1, 1]
