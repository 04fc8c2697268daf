"""Double support with a leaning torso against Pinocchio, and what it shares with planned motions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.gaits.nao.leaning_torso import check_yaw_pitches
from nlp_gait.robots import Robot, load_robot
from tests.backends.toys import row_violations
from tests.evaluation import check_power, evaluated
from tests.pinocchio_oracle import check_halves, floating_model

pin = pytest.importorskip("pinocchio")  # needs NumPy 2

POSE_TOLERANCE = 1e-9  # of two double-precision algorithms
OWN = 8
PAPER = (0.30, 0.006, 0.0006, 0.03, 0.03, -0.05, -0.05, 1.0)
ANKLES_XY = {"L": (0.06, 0.05), "R": (0.12, -0.05)}
LEAN = ("torso_roll_rad", "torso_pitch_rad")


@cache
def problem_of(share: str = "printed", order: str = "spline-2") -> GaitProblem:
    return load("nao-dsp-free", trajectory=order, samples_per_interval=1, torso_share=share)


def leaning(seed: int, lean: float = 0.2) -> Array:
    """A motion in which the torso shifts and leans to both sides, and the arms swing."""
    problem = problem_of()
    rng = np.random.default_rng(seed)
    x = np.zeros(len(problem.names))
    x[:OWN] = PAPER
    for i, name in enumerate(problem.names[OWN:], start=OWN):
        size = lean if name.startswith(LEAN) else 0.01 if name.startswith("hip") else 0.3
        x[i] = size * rng.normal()
    return x


def ankle_of(robot: Robot, side: str) -> Array:
    return np.array([*ANKLES_XY[side], robot.feet["left"].ankle_height_m])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_the_loop_closes_in_pinocchio(seed: int) -> None:
    """From the left sole outwards, the right one lies where it stands, flat and at rest, and the torso where it is planned."""
    robot, signals = load_robot("nao-v5"), problem_of().signals(leaning(seed))
    model = floating_model(robot)
    data = model.createData()
    assert np.abs(signals.arrays["q"][:, signals.joints.index("LHipYawPitch")]).max() > 1e-4
    for sample in range(11):
        q0, v0, a0 = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for joint, *values in zip(
            signals.joints, *(signals.arrays[k][sample] for k in ("q", "qd", "qdd")), strict=True
        ):
            entry = model.joints[model.getJointId(joint)]
            q0[entry.idx_q], v0[entry.idx_v], a0[entry.idx_v] = values
        left, right = (model.getJointId(f"{side}AnkleRoll") for side in "LR")
        pin.forwardKinematics(model, data, q0, v0, a0)
        between = data.oMi[left].actInv(data.oMi[right])
        expected = ankle_of(robot, "R") - ankle_of(robot, "L")
        np.testing.assert_allclose(between.translation, expected, rtol=0, atol=POSE_TOLERANCE)
        np.testing.assert_allclose(between.rotation, np.eye(3), rtol=0, atol=POSE_TOLERANCE)
        base = pin.SE3(np.eye(3), ankle_of(robot, "L")) * data.oMi[left].inverse()
        np.testing.assert_allclose(base.translation, signals.arrays["hip"][sample], rtol=0, atol=POSE_TOLERANCE)
        for frame in (pin.getVelocity, pin.getAcceleration):  # both soles move as one body with the torso's motion
            moved = [data.oMi[foot].act(frame(model, data, foot, pin.LOCAL)).vector for foot in (left, right)]
            np.testing.assert_allclose(moved[0], moved[1], rtol=0, atol=POSE_TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize("share", ["printed", "lever"])
def test_torques_and_zmp_are_those_of_two_floating_halves(share: str) -> None:
    robot, signals = load_robot("nao-v5"), problem_of(share).signals(leaning(0))
    check_halves(signals, robot, share, 0.06, 0.12)


@pytest.mark.slow
def test_the_objective_is_the_power_of_the_signals() -> None:
    check_power(problem_of(), map(leaning, range(2)))


@pytest.mark.slow
def test_without_a_lean_it_is_the_planned_motion() -> None:
    planned, free = load("nao-dsp", trajectory="spline-2", samples_per_interval=1), problem_of()
    x = leaning(1, lean=0.0)
    assert free.names[: len(planned.names)] == planned.names
    mine, theirs = free.signals(x), planned.signals(x[: len(planned.names)])
    for signal, values in theirs.arrays.items():
        np.testing.assert_allclose(mine.arrays[signal], values, rtol=0, atol=1e-9, err_msg=signal)
    cost, expected = (evaluated(p, x[: len(p.names)]).cost for p in (free, planned))
    assert cost == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_the_ends_are_the_papers() -> None:
    mine = problem_of().signals(leaning(2))
    theirs = load("nao-dsp").signals(np.array(PAPER))
    for signal in ("q", "qd", "hip", "com"):
        for row in (0, -1):
            np.testing.assert_allclose(mine.arrays[signal][row], theirs.arrays[signal][row], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_where_the_loop_stays_open_a_row_says_so() -> None:
    problem, x = problem_of(), leaning(0)
    lean = [i for i, name in enumerate(problem.names) if name.startswith(LEAN)]
    x[lean] = 0.3
    assert not any(row.name.startswith("sole_turn") for row in row_violations(problem, x))
    x[lean] = 3.0
    assert any(row.name.startswith("sole_turn") for row in row_violations(problem, x))


def test_hips_that_yaw_alike_are_refused() -> None:
    robot = load_robot("nao-v5")
    right = replace(robot.joint("RHipYawPitch"), axis=robot.joint("LHipYawPitch").axis)
    with pytest.raises(InputError, match="must differ in z"):
        check_yaw_pitches(replace(robot, joints={**robot.joints, "RHipYawPitch": right}))
    with pytest.raises(InputError, match="torso_share must be one of"):
        load("nao-dsp-free", torso_share="equal")
