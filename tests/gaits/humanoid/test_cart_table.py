"""The textbook's walk of a robot with offsets in every joint of its legs: its path, Pinocchio's loads, and how it is judged."""

from __future__ import annotations

import numpy as np
import pytest

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, Signals, load, sample_finely
from nlp_gait.gaits.biped.cart_table import Footsteps, plan_cart_table_walk
from nlp_gait.gaits.biped.recorded_cycle import RecordedCycles
from nlp_gait.gaits.humanoid.body import GRAVITY, make_humanoid
from nlp_gait.gaits.humanoid.problems import make_humanoid_cycles
from tests.pinocchio_oracle import Standing, floating_model, stand
from tests.robots.crooked import SOLE_AHEAD_M, crooked

pytest.importorskip("urdf_parser_py")

STEPS = Footsteps(step_m=0.1, single_s=0.8, double_s=0.6, hip_height_m=0.38, lift_m=0.03)
# Two double-precision algorithms, relative to the largest torque, and on lengths of a metre.
TORQUE_TOLERANCE, ZMP_TOLERANCE_M = 1e-10, 1e-12
# On both feet each half of the robot stands on its own: the right sole is as flat and still as splines between samples leave it.
STANDING_TOLERANCE_M = 1e-6


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    return crooked(tmp_path_factory.mktemp("crooked"))


@pytest.fixture(scope="module")
def cycles(path: str) -> RecordedCycles:
    return make_humanoid_cycles(path, intervals=4)


@pytest.fixture(scope="module")
def walk(cycles: RecordedCycles) -> Result:
    return plan_cart_table_walk(cycles, STEPS)


@pytest.fixture(scope="module")
def signals(walk: Result) -> Signals:
    return sample_finely(walk)


@pytest.mark.slow
def test_the_cycle_is_one_step_at_a_constant_height_and_continues_mirrored(
    cycles: RecordedCycles, walk: Result, signals: Signals
) -> None:
    hip, robot = signals.arrays["hip"], walk.problem.display.simulation_model.robot  # type: ignore[union-attr]
    assert walk.x == pytest.approx((0.8, 0.6, 0.1), abs=1e-12) and walk.problem.display.simulation_model.repeats  # type: ignore[union-attr]
    assert hip[-1] == pytest.approx(hip[0] * (1, -1, 1) + (0.1, 0, 0), abs=1e-9)
    # The middle of both hips is where the file has it below the root.
    middle = cycles.body.hip_m[2]
    assert hip[:, 2] + middle == pytest.approx(STEPS.hip_height_m, abs=1e-6)
    right = signals.arrays["right_foot"]
    assert right[:, 2].max() == pytest.approx(STEPS.lift_m, abs=1e-5)
    assert right[[0, -1], 0] == pytest.approx([-0.1, 0.1], abs=1e-9)
    assert robot.feet["left"].front_m - robot.feet["left"].back_m == pytest.approx(2 * SOLE_AHEAD_M)


def oracles(walk: Result, signals: Signals, samples: Array) -> list[Standing]:
    robot = walk.problem.display.simulation_model.robot  # type: ignore[union-attr]
    model, foot = floating_model(robot), robot.feet["left"]
    found = []
    for k in samples:
        q, qd, qdd = (
            dict(zip(signals.joints, map(float, signals.arrays[a][k]), strict=True)) for a in ("q", "qd", "qdd")
        )
        ankle = signals.arrays["left_foot"][k] + [0.0, 0.0, foot.ankle_height_m]
        found.append(stand(model, robot.joint_to[foot.link].name, ankle, q, qd, qdd, GRAVITY))
    return found


@pytest.mark.slow
def test_torques_and_zmp_are_pinocchios(walk: Result, signals: Signals) -> None:
    """On one foot all of it; on both feet the ZMP, which both halves of the robot together must have."""
    samples = np.arange(0, len(signals.arrays["t"]), 5)
    for k, expected in zip(samples, oracles(walk, signals, samples), strict=True):
        single = signals.arrays["t"][k] <= STEPS.single_s
        tolerance = ZMP_TOLERANCE_M if single else STANDING_TOLERANCE_M
        np.testing.assert_allclose(signals.arrays["zmp"][k], expected.zmp, rtol=0, atol=tolerance)
        np.testing.assert_allclose(signals.arrays["hip"][k], expected.torso, rtol=0, atol=ZMP_TOLERANCE_M)
        if single:
            torque = np.array([expected.torques[joint] for joint in signals.joints])
            error = np.abs(signals.arrays["tau"][k] - torque).max() / np.abs(torque).max()
            assert error < TORQUE_TOLERANCE


@pytest.mark.slow
def test_the_whole_bodys_zmp_is_the_planned_one(walk: Result, signals: Signals) -> None:
    """Under the middle of the left sole, then straight to that of the right one."""
    robot = walk.problem.display.simulation_model.robot  # type: ignore[union-attr]
    left, right = (signals.arrays[f"{side}_foot"][-1, :2] for side in ("left", "right"))
    foot = robot.feet["left"]
    offset = np.array([SOLE_AHEAD_M, (foot.left_m - foot.right_m) / 2])
    share = np.clip((signals.arrays["t"] - STEPS.single_s) / STEPS.double_s, 0.0, 1.0)[:, None]
    planned = (1.0 - share) * (left + offset) + share * (right + offset * (1, -1))
    assert np.sqrt(np.mean((signals.arrays["zmp"] - planned) ** 2)) < 0.003


@pytest.mark.slow
def test_a_planned_cycle_that_is_read_back_gets_the_same_verdict(path: str, cycles: RecordedCycles) -> None:
    """Its torso leans; a spline through samples 10 ms apart is this near to a cubic hip."""
    problem = load("humanoid-cycle", robot=path, intervals=4)
    usual = [make_humanoid(path).narrow(variable) for variable in problem.variables]
    x = np.array([(variable.lower + variable.upper) / 2 for variable in usual])
    x[problem.variable_index("single_support_time_s")] = STEPS.single_s
    x[problem.variable_index("double_support_time_s")] = STEPS.double_s
    finer = problem.dense(20)
    assert finer is not None
    dense = finer.signals(x)
    back = cycles.judge(dense.arrays["t"], dense.arrays["q"], STEPS.single_s)
    own, before = (build_exact_model(r.problem).at(r.x, r.problem.p) for r in (back, Result(problem=problem, x=x)))
    for index, value in before.indexes.items():
        assert own.indexes[index] == pytest.approx(value, rel=2e-3, abs=1e-4), index
    rows = dict(zip(build_exact_model(back.problem).row_names, own.g, strict=True))
    for name, value in zip(build_exact_model(problem).row_names, before.g, strict=True):
        kind = name.split("[")[0].removeprefix("ssp_").removeprefix("dsp_")
        if kind in ("joint_angle", "reach", "effort", "torque_change", "dbm_x", "dbm_y"):
            assert rows[name] == pytest.approx(value, abs=2e-2), name


@pytest.mark.parametrize(
    ("height_m", "message"),
    [
        (0.48, "a hip 0.48 m high reaches no step of 0.1 m: at .* the right ankle is too far; lower the hip"),
        (0.08, "at .* the right leg misses its foot; choose another height of the hip"),
    ],
)
def test_a_hip_that_reaches_no_step_is_refused(cycles: RecordedCycles, height_m: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        plan_cart_table_walk(cycles, Footsteps(**{**vars(STEPS), "hip_height_m": height_m}))
