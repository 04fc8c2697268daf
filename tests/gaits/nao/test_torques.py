"""Torques, ZMP and centre of mass of the NAO problems against Pinocchio."""

import json
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.gaits.nao.body import GRAVITY
from nlp_gait.robots import load_robot
from tests.pinocchio_oracle import check_halves, check_standing, floating_model, read_state, stand

# Two double-precision algorithms on torques of up to some hundred Nm.
TORQUE_TOLERANCE_NM = 1e-8

FEASIBLE = {
    "nao-ssp": (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4.0),
    "nao-dsp": (0.31, 0.00683, 0.00007, 0.00485, 0.06828, -0.05291, -0.02170, 2.0),
}
SEEDS = range(6)


def motions(problem: GaitProblem) -> list[Array]:
    """A feasible gait and random ones, most of them infeasible."""
    return [
        np.array(FEASIBLE[problem.name]),
        *(np.random.default_rng(seed).uniform(problem.lower, problem.upper) for seed in SEEDS),
    ]


@pytest.mark.parametrize("robot", ["nao-v5", "nao-v6"])
def test_single_support_equals_a_floating_base_model_with_the_foot_held(robot: str) -> None:
    problem, data = load("nao-ssp", robot=robot), load_robot(robot)
    model = floating_model(data)
    ankle = np.array([0.06, 0.05, data.feet["left"].ankle_height_m])
    for x in motions(problem):
        check_standing(problem.signals(x), model, ankle, range(11), "com")


@pytest.mark.parametrize("rule", ["printed", "lever"])
def test_double_support_equals_two_floating_halves_each_on_its_foot(rule: str) -> None:
    problem, data = load("nao-dsp", torso_share=rule), load_robot("nao-v5")
    for x in motions(problem):
        check_halves(problem.signals(x), data, rule, 0.06, 0.12)


@pytest.mark.parametrize("name", ["nao-ssp", "nao-dsp"])
def test_separate_arms_load_no_leg_and_move_on_a_torso_at_rest(name: str, tmp_path: Path) -> None:
    """The legs' torques are those of a robot with arms of a milligram; the arms' are those of arms that a still torso carries."""
    data = json.loads((resources.files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8"))
    arm = ("Shoulder", "Bicep", "Elbow", "ForeArm")
    for link in ("l_wrist", "r_wrist", *(side + part for side in "LR" for part in arm)):
        data["links"][link] |= {"mass_kg": 1e-6, "inertia_com_kgm2": [1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0]}
    light = tmp_path / "light-arms.json"
    light.write_text(json.dumps(data))
    x, robot = np.array(FEASIBLE[name]), load_robot("nao-v5")
    separate, armless = (load(name, **options).signals(x) for options in ({"arms": "separate"}, {"robot": str(light)}))
    legs = [k for k, joint in enumerate(separate.joints) if "Hip" in joint or "Knee" in joint or "Ankle" in joint]
    tau = separate.arrays["tau"]
    np.testing.assert_allclose(tau[:, legs], armless.arrays["tau"][:, legs], atol=1e-5)
    np.testing.assert_allclose(separate.arrays["zmp"], load(name).signals(x).arrays["zmp"], atol=TORQUE_TOLERANCE_NM)
    oracle = stand(floating_model(robot), "torso", np.zeros(3), *read_state(separate, 3), GRAVITY)
    arms = [k for k in range(len(separate.joints)) if k not in legs]
    np.testing.assert_allclose(
        tau[3, arms], [oracle.torques[separate.joints[k]] for k in arms], atol=TORQUE_TOLERANCE_NM
    )
