"""A humanoid that is not NAO: solved without a change of code, and a message for legs that the closed form does not fit."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.solution import Solution
from nlp_gait.gaits.nao.body import GRAVITY, LegGeometry, measure_leg
from nlp_gait.robots import load_robot
from tests.evaluation import evaluated
from tests.pinocchio_oracle import check_standing, floating_model, read_state, stand
from tests.robots.custom import HEAVIER, HIP_OFFSET, THIGH, TIBIA, Record, humanoid, nao, written

TORSO_TOLERANCE_M = 1e-12
NAMES = ("nao-ssp", "nao-dsp")
SOLVER = IpoptSettings(compiled=False, hessian="limited-memory")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(tmp_path_factory.mktemp("humanoid"), humanoid())


@pytest.fixture(scope="module")
def gaits(path: str) -> dict[str, tuple[GaitProblem, Solution]]:
    problems = {name: load(name, robot=path, intervals=4) for name in NAMES}
    return {name: (problem, solve(problem, starts=2, solver=SOLVER)) for name, problem in problems.items()}


@pytest.mark.parametrize("name", NAMES)
def test_another_humanoid_is_solved_without_any_setting(
    gaits: dict[str, tuple[GaitProblem, Solution]], name: str
) -> None:
    _, solution = gaits[name]
    assert [start.converged for start in solution.starts] == [True, True]
    # On the usual grid double support has two optima, 0.71137 and 0.71158 W: eight starts on all rows end in the second.
    assert solution.starts[0].objective == pytest.approx(solution.starts[1].objective, rel=5e-4)


@pytest.mark.parametrize("name", NAMES)
def test_its_feet_stand_below_its_hip_joints_and_its_torso_where_planned(
    gaits: dict[str, tuple[GaitProblem, Solution]], path: str, name: str
) -> None:
    """Pinocchio puts the torso from either foot where the plan wants it; in single support it gives the torques too."""
    problem, solution = gaits[name]
    signals = problem.signals(solution.x)
    robot = load_robot(path)
    model = floating_model(robot)
    for sample in range(5):
        for side, foot in (("L", "left"), ("R", "right")):
            sole = signals.arrays[f"{foot}_foot"][sample]
            assert sole[1] == (HIP_OFFSET if side == "L" else -HIP_OFFSET)
            ankle = sole + np.array([0.0, 0.0, robot.feet[foot].ankle_height_m])
            oracle = stand(model, f"{side}AnkleRoll", ankle, *read_state(signals, sample), GRAVITY)
            np.testing.assert_allclose(oracle.torso, signals.arrays["hip"][sample], rtol=0, atol=TORSO_TOLERANCE_M)
            if name == "nao-ssp" and side == "L":
                check_standing(signals, model, ankle, [sample])


def test_what_depends_on_the_robot_follows_from_its_file(path: str) -> None:
    """Ankle 0.04519 + hips 0.085 + shares of 0.23 m; margins a third and a quarter of a sole of 0.16 m by 0.09 m."""
    problem = load("nao-ssp", robot=path)
    assert (problem.lower[0], problem.upper[0]) == (0.266, 0.334)
    assert (problem.value("dbm_x_mean_limit_m"), problem.value("dbm_y_mean_limit_m")) == (0.0533, 0.0225)
    assert problem.value("LKneePitch_rad.upper") == load_robot(path).joint("LKneePitch").limits_rad[1]
    assert load_robot(path).mass_kg == pytest.approx(HEAVIER * load_robot("nao-v5").mass_kg)
    assert measure_leg(load_robot(path), "R") == LegGeometry((0.0, -HIP_OFFSET, -0.085), THIGH, TIBIA, 0.04519)


def test_joints_that_no_gait_moves_are_locked(tmp_path: Path) -> None:
    """A finger of 0.01 kg, and a robot without a head."""
    raw = nao()
    finger = {"mass_kg": 0.01, "com_m": [0.01, 0.0, 0.0], "inertia_com_kgm2": [1e-6, 1e-6, 1e-6, 0.0, 0.0, 0.0]}
    raw["links"]["finger"] = finger
    raw["joints"]["LHand"] = raw["joints"]["LWristYaw"] | {"parent": "l_wrist", "child": "finger"}
    for link, joint in (("Head", "HeadPitch"), ("Neck", "HeadYaw")):
        del raw["links"][link], raw["joints"][joint]
    problem = load("nao-ssp", robot=written(tmp_path, raw))
    x = (problem.lower + problem.upper) / 2
    assert np.isfinite(evaluated(problem, x).cost)
    assert problem.display.skeleton is not None  # without a neck it is drawn as any biped
    drawn = problem.display.skeleton(problem.signals(x), problem.parameter_values)
    assert {limb.side for limb in drawn.limbs} == {"left", "right", "trunk"}  # up to the shoulders


def changed(group: str, name: str, **values: object) -> Callable[[Record], None]:
    def change(raw: Record) -> None:
        raw[group][name] |= values

    return change


MISFITS = [
    (changed("joints", "RHipRoll", axis=[-1.0, 0.0, 0.0]), r"joint 'RHipRoll': its axis must be .*got"),
    (changed("joints", "LKneePitch", origin_m=[0.01, 0.0, -0.1]), r"joint 'LKneePitch': .*straight below"),
    (changed("joints", "LHipPitch", origin_m=[0.0, 0.0, -0.02]), r"joint 'LHipPitch': .* cross that"),
    (changed("joints", "LAnkleRoll", origin_m=[0.0, 0.0, -0.02]), r"joint 'LAnkleRoll': .* cross that"),
    (changed("feet", "left", link="LAnklePitch"), r"foot 'left': its link must be 'l_ankle'"),
    (changed("joints", "LHipYawPitch", parent="LShoulder"), r"joint 'LHipYawPitch': its parent must be link 'torso'"),
]


@pytest.mark.parametrize(("misfit", "message"), MISFITS, ids=[message[:30] for _, message in MISFITS])
def test_legs_of_another_kind_are_refused_by_joint(
    tmp_path: Path, misfit: Callable[[Record], None], message: str
) -> None:
    raw = nao()
    misfit(raw)
    with pytest.raises(InputError, match=message):
        load("nao-dsp", robot=written(tmp_path, raw))


def test_a_yaw_joint_above_the_other_hip_joints_shifts_their_centre(tmp_path: Path) -> None:
    raw = nao()
    for side, y in (("L", 0.05), ("R", -0.05)):
        raw["joints"][f"{side}HipYawPitch"]["origin_m"] = [0.0, y / 2, -0.05]
        raw["joints"][f"{side}HipRoll"]["origin_m"] = [0.0, y / 2, -0.035]
    assert measure_leg(load_robot(written(tmp_path, raw)), "L").hip_m == pytest.approx((0.0, 0.05, -0.085))


def test_a_robot_that_lacks_a_joint_is_answered_with_its_name(tmp_path: Path) -> None:
    text = json.dumps(nao()).replace('"LWristYaw"', '"left_wrist"')
    with pytest.raises(GaitError, match="does not suit the NAO problems: unknown joint of robot nao-v5 'LWristYaw'"):
        load("nao-ssp", robot=written(tmp_path, text))


@pytest.mark.parametrize("name", NAMES)
def test_feet_of_unequal_height_both_reach_the_ground(tmp_path: Path, name: str) -> None:
    raw = nao()
    raw["feet"]["right"]["ankle_height_m"] = 0.05
    problem = load(name, robot=written(tmp_path, raw))
    x: Array = (problem.lower + problem.upper) / 2
    soles = problem.signals(x).arrays
    assert soles["left_foot"][:, 2] == pytest.approx(0.0, abs=1e-15)
    assert soles["right_foot"][[0, -1], 2] == pytest.approx(0.0, abs=1e-15)
