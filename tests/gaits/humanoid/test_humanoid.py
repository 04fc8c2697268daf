"""Gaits of a robot with offsets in every joint of its legs: against Pinocchio, in both interpretations, and simulated."""

import math
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, Result, load
from nlp_gait.formulation.solution import Solution
from nlp_gait.gaits.humanoid.body import GRAVITY
from tests.pinocchio_oracle import floating_model, read_state, stand
from tests.robots.crooked import crooked

pytest.importorskip("lxml")

# Two double-precision algorithms, relative to the largest torque, and on lengths of a metre.
TORQUE_TOLERANCE, ZMP_TOLERANCE_M = 1e-10, 1e-12
CLOSURE_M = 1e-9
NAMES = ("humanoid-ssp", "humanoid-dsp", "humanoid-cycle")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    return crooked(tmp_path_factory.mktemp("crooked"))


@pytest.fixture(scope="module")
def problem(path: str) -> GaitProblem:
    return load("humanoid-ssp", robot=path, intervals=5)


@pytest.fixture(scope="module")
def solution(problem: GaitProblem) -> Solution:
    return solve(problem, starts=1, seed=0, solver=IpoptSettings(few_rows=False, hessian="limited-memory"))


def reachable(problem: GaitProblem, count: int) -> Array:
    """Random candidates whose legs reach their feet."""
    model, rng, found = build_exact_model(problem), np.random.default_rng(0), []
    rows = [i for i, name in enumerate(model.row_names) if name.startswith("closure")]
    while len(found) < count:
        x = rng.uniform(problem.lower, problem.upper)
        if model.at(x, problem.p).g[rows].max() < CLOSURE_M:
            found.append(x)
    return np.array(found)


def test_torques_and_zmp_are_pinocchios(problem: GaitProblem) -> None:
    model = problem.display.simulation_model
    assert model is not None
    robot = model.robot
    oracle, ankle = floating_model(robot), robot.joint_to[robot.feet["left"].link].name
    for x in reachable(problem, 4):
        signals = problem.signals(x)
        arrays = signals.arrays
        for k in (0, 2, 5):
            foot = arrays["left_foot"][k] + [0.0, 0.0, robot.feet["left"].ankle_height_m]
            found = stand(oracle, ankle, foot, *read_state(signals, k), GRAVITY)
            expected = np.array([found.torques[joint] for joint in signals.joints])
            largest = np.abs(expected).max()
            np.testing.assert_allclose(arrays["tau"][k] / largest, expected / largest, rtol=0, atol=TORQUE_TOLERANCE)
            np.testing.assert_allclose(arrays["zmp"][k], found.zmp, rtol=0, atol=ZMP_TOLERANCE_M)
            np.testing.assert_allclose(arrays["hip"][k], found.torso, rtol=0, atol=ZMP_TOLERANCE_M)


def test_an_optimum_is_exact_closed_and_the_lifted_problems(problem: GaitProblem, solution: Solution) -> None:
    assert solution.converged and solution.best.violation == 0.0
    x = np.array(list(solution.x.values()))
    model, exact = build_nlp(problem), build_exact_model(problem).at(x, problem.p)
    closure = [i for i, name in enumerate(build_exact_model(problem).row_names) if name.startswith("closure")]
    assert exact.g[closure].max() <= CLOSURE_M
    nlp = model.nlp
    w = model.start(problem, x, model.widths[-1])
    from casadi import Function

    cost = Function("cost", [nlp["x"], nlp["p"]], [nlp["f"]])(w, np.append(problem.p, model.widths[-1]))
    assert float(cost) == pytest.approx(exact.cost, rel=1e-6)


def test_the_torso_leans_as_its_attitude_says(problem: GaitProblem, solution: Solution) -> None:
    signals = problem.signals(solution.x)
    w, x, y, z = signals.arrays["attitude"][0]
    roll, pitch = solution.x["torso_roll_start_rad"], solution.x["torso_pitch_start_rad"]
    assert 2 * math.atan2(y, w) == pytest.approx(pitch) and 2 * math.atan2(x, w) == pytest.approx(roll)
    assert w * w + x * x + y * y + z * z == pytest.approx(1.0)


@pytest.mark.parametrize("name", NAMES)
def test_sizes_follow_the_robot_and_nao_keeps_its_own(path: str, name: str) -> None:
    nao, other = load(name), load(name, robot=path)
    assert nao.value("torque_change_limit_Nm") == 1.2
    assert nao.value("heat_loss_W_per_Nm2") == pytest.approx(0.025, rel=1e-3)
    biped_scale = 0.4 / 0.2029
    time = nao.display.durations[0]
    i, j = nao.variable_index(time), other.variable_index(time)
    assert other.upper[j] / nao.upper[i] == pytest.approx(math.sqrt(biped_scale), rel=0.05)
    assert other.value("torque_change_limit_Nm") > 1.2 * biped_scale


@pytest.mark.parametrize("name", NAMES)
def test_every_problem_has_finite_values_a_skeleton_and_a_mirror_image(path: str, name: str) -> None:
    problem = load(name, robot=path, intervals=2)
    x = (problem.lower + problem.upper) / 2
    values = build_exact_model(problem).at(x, problem.p)
    assert math.isfinite(values.cost) and math.isfinite(values.violation)
    signals = problem.signals(x)
    assert problem.display.skeleton is not None and problem.display.simulation_model is not None
    drawn = problem.display.skeleton(signals, problem.parameter_values)
    assert {limb.side for limb in drawn.limbs} >= {"left", "right"}
    for foot, limb in zip(("left_foot", "right_foot"), drawn.limbs, strict=False):
        np.testing.assert_allclose(limb.points[:, -1], signals.arrays[foot], atol=1e-12)
        np.testing.assert_allclose(limb.points[0, 0], signals.arrays["hip"][0], atol=1e-9)


def test_steps_of_another_length_and_motions_of_more_coefficients(path: str) -> None:
    longer = load("humanoid-ssp", robot=path, step_length_m=0.15, trajectory="spline-2", samples_per_interval=1)
    arrays = longer.signals((longer.lower + longer.upper) / 2).arrays
    assert arrays["right_foot"][-1, 0] == pytest.approx(0.3)
    assert len(longer.names) == 13 + 7 * 3
    with pytest.raises(InputError, match="step_length_m must be a finite number"):
        load("humanoid-ssp", robot=path, step_length_m=-0.1)


def test_the_step_is_simulated_upright_and_exported(problem: GaitProblem, solution: Solution, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    from nlp_gait.export.formats import write_as
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import measure
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import simulate_plan

    result = Result(problem=problem, x=np.array(list(solution.x.values())))
    plan = make_plan(result)
    found = measure(plan, simulate_plan(plan), Drive())
    assert not found.fallen and found.largest_tilt_deg < 5.0
    assert found.measured.total_W == pytest.approx(found.predicted.total_W, rel=0.1)
    for name, ending in (("csv", "csv"), ("json", "json"), ("mjcf", "xml"), ("webots", "motion")):
        file = tmp_path / f"gait.{ending}"
        write_as(name, file, result, 40)
        assert file.stat().st_size > 1000
    with pytest.raises(InputError, match="only NAO has NAOqi"):
        write_as("naoqi", tmp_path / "gait.json", result, 40)
