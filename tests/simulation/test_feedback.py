"""Balance feedback: what it adds, that it helps, and that its sensors count."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics
from tests.compare.cli.calls import as_json, one_sentence

pytest.importorskip("mujoco")

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.engine import load_mujoco  # noqa: E402
from nlp_gait.simulation.feedback import BalanceController, Feedback, compute_load_shares  # noqa: E402
from nlp_gait.simulation.measurements import measure_walk  # noqa: E402
from nlp_gait.simulation.plan import SIDES, Plan, make_plan  # noqa: E402
from nlp_gait.simulation.simulate import (  # noqa: E402
    Conditions,
    Simulation,
    prepare,
    simulate_plan,
)

NOISELESS = Feedback(position_noise_m=0.0, velocity_noise_m_s=0.0, tilt_noise_rad=0.0, rate_noise_rad_s=0.0)
IDEAL = replace(NOISELESS, delay_s=0.0)
DOWNHILL = Conditions(slope_rad=(-0.05236, 0.0))  # 3 degrees
STEPS = 2


@pytest.fixture(scope="module")
def plan(cycle: Result) -> Plan:
    return make_plan(cycle, STEPS)


@pytest.fixture(scope="module")
def step(cycle: Result) -> Plan:
    return make_plan(cycle, 1)


@cache
def simulate(plan: Plan, feedback: Feedback | None, conditions: Conditions | None = None) -> Simulation:
    return simulate_plan(plan, conditions, Drive(feedback=feedback))


@pytest.mark.slow
def test_without_springs_it_is_open_loop_to_the_last_bit(step: Plan) -> None:
    none = {
        "spring": 0.0,
        "damper": 0.0,
        "tilt_spring": 0.0,
        "tilt_damper": 0.0,
    }
    weightless, alone = simulate(step, replace(Feedback(), **none)), simulate(step, None)
    for name in ("q", "torque", "set_points", "feet"):
        np.testing.assert_array_equal(getattr(weightless, name), getattr(alone, name))


@pytest.mark.slow
def test_downhill_it_saves_energy_and_keeps_the_torso_upright(plan: Plan) -> None:
    def energy_and_tilt(feedback: Feedback | None) -> tuple[float, float]:
        trace = simulate(plan, feedback, DOWNHILL)
        walk = measure_walk(plan, trace, Drive(feedback=feedback), STEPS)
        assert walk.engine_J_per_planned_m is not None
        return walk.engine_J_per_planned_m, walk.measurements.largest_tilt_deg

    (alone, swaying), (helped, upright) = (energy_and_tilt(feedback) for feedback in (None, Feedback()))
    assert helped < 0.95 * alone
    assert upright < 0.8 * swaying


@pytest.mark.slow
def test_the_load_passes_from_foot_to_foot(plan: Plan) -> None:
    """In single support one foot has it all; in between, the point that divides their distance is nearest to the ZMP."""
    single, double, period = 0.4, 0.56565, 0.96565
    shares = compute_load_shares(plan, np.array([0.2, single + 0.25 * double, single + 0.75 * double, period + 0.2]))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert shares[0].tolist() == [1.0, 0.0] and shares[3].tolist() == [0.0, 1.0]
    assert 1.0 > shares[1, 0] > shares[2, 0] > 0.0
    at = np.array([single + 0.25 * double])
    feet = np.stack([plan.at("left_foot", at)[0, :2], plan.at("right_foot", at)[0, :2]])
    along = feet[0] - feet[1]
    np.testing.assert_allclose((shares[1] @ feet - plan.at("zmp", at)[0]) @ along, 0.0, atol=1e-12)  # the nearest point


def test_torques_do_the_virtual_work_of_the_springs(plan: Plan) -> None:
    """At lift-off, when both feet carry: slopes of force times the torso's place over each foot, by our own kinematics."""
    drive, names, start = Drive(), list(plan.joints), np.zeros(1)
    stiffness = np.array([drive.stiffness(plan.robot.joint(name)) for name in names])
    spring = replace(IDEAL, damper=0.0, tilt_damper=0.0, growth_per_s=0.0)
    model, data = prepare(plan, Conditions(), drive, "rectangle")
    for name, bent in (("LAnklePitch", 0.1), ("LKneePitch", 0.05), ("RHipRoll", 0.1)):  # the torso's place changes
        data.qpos[model.joint(name).qposadr[0]] += bent
    load_mujoco().mj_forward(model, data)
    shares = compute_load_shares(plan, start)[0]
    assert shares.min() > 0.1
    feet = [data.site(side).xpos for side in SIDES]
    planned = plan.at("hip", start)[0] - shares @ np.stack([plan.at(f"{side}_foot", start)[0] for side in SIDES])
    height = plan.at("hip", start)[0, 2]
    force = (
        IDEAL.spring
        * plan.robot.mass_kg
        * plan.gravity
        / height
        * (planned - (data.body("torso").xpos - shares @ np.stack(feet)))
    )
    assert np.linalg.norm(force) > 1.0
    expected = np.zeros(len(names))
    for share, side in zip(shares, SIDES, strict=True):
        expected += share * virtual_work(plan, plan.robot.feet[side].link, force, plan.at("q", start)[0])
    found = stiffness * BalanceController(spring, plan, stiffness, model).correct(np.zeros(len(stiffness)), data)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(expected).max() > 0.1


def virtual_work(plan: Plan, foot: str, force: Array, at: Array) -> Array:
    """Slope of the work of a force on the torso's origin over each joint, one foot held flat [Nm]."""
    q = SX.sym("q", len(plan.joints))
    tree = make_tree(plan.robot, foot)
    poses = forward_kinematics(tree, dict(zip(plan.joints, ca.vertsplit(q), strict=True)), SX(3, 1))
    torso = next(i for i, body in enumerate(tree) if body.link.name == "torso")
    # A body's reference point is the joint through which it is reached: here a hip, from which its origin is this far.
    joint = tree[torso].joint
    assert joint is not None
    place = poses[torso].position - poses[torso].rotation @ DM(joint.origin_m)
    slopes = ca.Function("slopes", [q], [ca.gradient(DM(force).T @ place, q)])
    return np.asarray(slopes(at)).ravel()


@pytest.mark.parametrize(("name", "value"), [("period_s", 0.0), ("delay_s", -0.01), ("spring", float("nan"))])
def test_settings_that_no_controller_has_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name} of a feedback must be"):
        Feedback(**{name: value})


@pytest.mark.slow
def test_the_commands_take_feedback_and_conditions(cycle: Result, tmp_path: Path) -> None:
    result = tmp_path / "cycle.json"
    result.write_text(json.dumps({"problem": "nao-cycle", "x": cycle.problem.by_name(cycle.x)}))
    flags = ["--steps", "1", "--slope-deg=-3,0", "--stiffness-factor", "0.9"]

    def torques(*more: str) -> float:
        return float(as_json("simulate", result, *flags, *more)["walk"]["engine_J_per_planned_m"])

    assert torques("--feedback", "torso-spring") != torques()
    assert "unknown feedback 'telepathy'" in one_sentence("simulate", result, "--feedback", "telepathy")
