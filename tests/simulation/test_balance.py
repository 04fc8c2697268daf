"""Balance of the whole body: footholds in closed form, torques against the engine, and walks that open loop does not survive."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result
from nlp_gait.simulation.balance.footholds import StepLimits, choose_step, clip_to_soles, find_shift
from nlp_gait.simulation.plan import Plan, make_plan
from tests.compare.cli.calls import as_json, one_sentence

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("daqp")

from nlp_gait.simulation.balance.controller import Balance, StepClock, WholeBodyBalance  # noqa: E402
from nlp_gait.simulation.balance.drives import load_drive  # noqa: E402
from nlp_gait.simulation.balance.reference import WalkReference, compute_left_load  # noqa: E402
from nlp_gait.simulation.balance.whole_body import Targets, Torques, WholeBodyQP  # noqa: E402
from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.engine import Addresses, place_root  # noqa: E402
from nlp_gait.simulation.mjcf import Bumps  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Push, SimulationRun, prepare  # noqa: E402

LIMITS = StepLimits(
    rate=6.0,
    carry=0.8,
    zmp_low=np.array([-0.03, -0.02]),
    zmp_high=np.array([0.05, 0.02]),
    shift_low=np.array([-0.2, -0.02]),
    shift_high=np.array([0.2, 0.1]),
)


@pytest.fixture(scope="module")
def plan(cycle: Result) -> Plan:
    return make_plan(cycle, 2)


@pytest.mark.parametrize("error", [(0.04, 0.01), (-0.05, -0.03), (0.01, 0.0)])
def test_a_shift_takes_what_the_ankles_leave_of_an_error(error: tuple[float, float]) -> None:
    """By integration of e' = rate (e - z) with the ankles at their limits against the error."""
    time, start = 0.3, np.array(error)
    zmp = np.where(start > 0.0, LIMITS.zmp_high, LIMITS.zmp_low)
    end = solve_ivp(lambda _, e: LIMITS.rate * (e - zmp), (0.0, time), start, rtol=1e-10, atol=1e-12).y[:, -1]
    expected = np.where(end * start > 0.0, end, 0.0) / LIMITS.carry
    np.testing.assert_allclose(find_shift(start, time, LIMITS), expected, atol=1e-8)


def test_a_step_is_hastened_where_its_foothold_is_out_of_reach_and_stays_where_nothing_is_wrong() -> None:
    assert choose_step(np.zeros(2), 0.4, 0.15, 0.52, LIMITS, 0.06)[0] == 0.4
    time, shift, left = choose_step(np.array([0.06, 0.0]), 0.4, 0.15, 0.52, LIMITS, 0.06)
    assert time < 0.4 and 0.0 < shift[0] < LIMITS.shift_high[0] and shift[1] == 0.0 and (left == 0.0).all()
    time, shift, left = choose_step(np.array([0.15, -0.06]), 0.4, 0.15, 0.52, LIMITS, 0.06)
    assert time == 0.15 and shift.tolist() == [LIMITS.shift_high[0], LIMITS.shift_low[1]] and left[0] > 0.0 > left[1]


def test_the_nearest_point_of_turned_soles_is_that_of_a_fine_grid() -> None:
    random = np.random.default_rng(0)
    places, yaws = np.array([[0.0, 0.05], [0.1, -0.06]]), np.array([0.3, -0.2])
    reaches = np.array([[0.1, 0.05, 0.04, 0.03], [0.1, 0.05, 0.03, 0.04]])
    for point in random.uniform(-0.3, 0.3, (20, 2)):
        nearest = clip_to_soles(point, places[:1], yaws[:1], reaches[:1])
        x, y = np.meshgrid(np.linspace(-0.05, 0.1, 151), np.linspace(-0.03, 0.04, 71))
        cos, sin = np.cos(yaws[0]), np.sin(yaws[0])
        grid = places[0] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1).reshape(-1, 2)
        assert np.linalg.norm(nearest - point) == pytest.approx(np.linalg.norm(grid - point, axis=1).min(), abs=2e-3)
        both = clip_to_soles(point, places, yaws, reaches)
        assert np.linalg.norm(both - point) <= np.linalg.norm(nearest - point) + 1e-12


def find_torque_limits(plan: Plan) -> Array:
    return np.array([plan.robot.joint(name).torque_limit_Nm for name in plan.joints])


def solve_instant(plan: Plan, share: float, mass: tuple[float, float, float], left_rolls: bool) -> tuple[Torques, Any]:
    """Return torques at a share of the plan's time and the engine's data; both have the same accelerations."""
    model, data = prepare(plan, Conditions(), Drive())
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    addresses, limits = Addresses(model, plan), find_torque_limits(plan)
    qp = WholeBodyQP(WalkReference(plan, model, limits), model, addresses, limits, friction=0.5)
    time = np.array([share * plan.duration_s])
    place_root(data.qpos, plan, plan.at("hip", time)[0], plan.attitude(time)[0])
    data.qpos[addresses.angles] = plan.at("q", time)[0]
    data.qvel[:] = np.random.default_rng(1).normal(0.0, 0.1, model.nv)
    mujoco.mj_forward(model, data)
    weight = plan.robot.mass_kg * plan.gravity
    targets = Targets(
        mass=np.array(mass),
        torso=np.zeros(3),
        feet=np.zeros((2, 6)),
        stands=(True, True),
        rolls=(left_rolls, False),
        joints=np.zeros(len(limits)),
        load_left=0.5,
        most_load=(3.0 * weight, 3.0 * weight),
    )
    solution = qp.solve(data, targets)
    assert solution is not None and (np.abs(solution.torques) <= limits).all()
    data.qfrc_applied[addresses.rates] = solution.torques
    sites, axes = addresses.soles.copy(), data.site_xmat[addresses.soles].reshape(2, 3, 3)
    if left_rolls:
        sites[0], axes[0] = addresses.tips[0], np.eye(3)
    for site, turn, wrench in zip(sites, axes, solution.wrenches.reshape(2, 6), strict=True):
        force, moment = turn @ wrench[:3], turn @ wrench[3:]
        mujoco.mj_applyFT(model, data, force, moment, data.site_xpos[site], model.site_bodyid[site], data.qfrc_applied)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc[addresses.rates], solution.accelerations, rtol=1e-6, atol=1e-5)
    return solution, data


def test_a_foothold_that_will_bear_no_load_is_not_moved(plan: Plan) -> None:
    reference = WalkReference(plan, prepare(plan, Conditions(), Drive())[0], find_torque_limits(plan))
    clock = StepClock(Balance(), reference)
    while clock.phase.swing is None:
        clock.advance(np.array([0.5, 0.5]), reference.sample("feet", clock.time_s).reshape(2, 3))
    pushed = reference.sample("dcm", clock.time_s) + 0.03
    assert clock.choose(pushed)[0].shift.any()
    reference._rows[:, reference._columns["carry"]] = 0.0
    assert not clock.choose(pushed)[0].shift.any()


def test_torques_and_wrenches_give_the_accelerations_in_the_engine(plan: Plan) -> None:
    solution, _ = solve_instant(plan, 0.0, (0.2, -0.1, 0.3), left_rolls=False)
    forces, weight = solution.wrenches.reshape(2, 6)[:, 2], plan.robot.mass_kg * plan.gravity
    assert forces.sum() == pytest.approx(weight * (1.0 + 0.3 / plan.gravity), rel=0.05) and (forces > 0.0).all()


def test_a_foot_that_rolls_is_held_at_the_tip_of_its_toe_where_no_moment_acts() -> None:
    problem = nlp_gait.load("stairs-climb", stairs=2, intervals=10)
    plan = make_plan(Result(problem=problem, x=problem.start_point(np.random.default_rng(0))))
    # At the begin of the second step the left foot is behind.
    solution, data = solve_instant(plan, 0.3, (0.2, 0.0, 0.0), left_rolls=True)
    assert solution.wrenches[2] > 0.1 * plan.robot.mass_kg * plan.gravity and (solution.wrenches[3:6] == 0.0).all()
    model = data.model
    tip, rows, drift = model.site("left tip").id, np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, rows, None, tip)
    mujoco.mj_jacDot(model, data, drift, None, data.site_xpos[tip], model.site_bodyid[tip])
    np.testing.assert_allclose(rows @ data.qacc + drift @ data.qvel, 0.0, atol=0.05)  # a weighted task


def test_a_wrench_is_allowed_just_where_forces_at_the_corners_of_a_sole_give_it(plan: Plan) -> None:
    model, _ = prepare(plan, Conditions(), Drive())
    limits = find_torque_limits(plan)
    reference, friction = WalkReference(plan, model, limits), 0.5
    rows = WholeBodyQP(reference, model, Addresses(model, plan), limits, friction).cone
    random, side = np.random.default_rng(0), friction / np.sqrt(2.0)
    for i, sole in enumerate(reference.soles):
        front, back, left, right = 0.95 * sole
        corners = [(x, y, 0.0) for x in (front, -back) for y in (left, -right)]
        given = np.hstack([np.vstack([np.eye(3), np.cross(corner, np.eye(3)).T]) for corner in corners])
        pyramid = np.array([[1.0, 0.0, -side], [-1.0, 0.0, -side], [0.0, 1.0, -side], [0.0, -1.0, -side]])
        allowed = 0
        for _ in range(100):
            wrench = np.append([*random.uniform(-0.3, 0.3, 2), 1.0], random.uniform(-1.0, 1.0, 3) * [left, front, 0.03])
            found = linprog(np.zeros(12), np.kron(np.eye(4), pyramid), np.zeros(16), given, wrench, bounds=(None, None))
            both = np.zeros(12)
            both[6 * i : 6 * i + 6] = wrench
            assert (rows @ both >= 0.0).all() == (found.status == 0)
            allowed += found.status == 0
        assert 10 < allowed < 90


@pytest.fixture(scope="module")
def standing(plan: Plan) -> Plan:
    """The first instant of the cycle, held for a while by strong joints; its ZMP is between the feet."""
    arrays = {name: np.repeat(array[:1], 4, axis=0) for name, array in plan.signals.arrays.items()}
    arrays |= {"t": np.linspace(0.0, 0.3, 4), "zmp": (arrays["left_foot"] + arrays["right_foot"])[:, :2] / 2}
    joints = {n: replace(joint, torque_limit_Nm=5.0 * joint.torque_limit_Nm) for n, joint in plan.robot.joints.items()}
    robot = replace(plan.robot, joints=joints)
    return replace(plan, robot=robot, signals=replace(plan.signals, arrays=arrays), steps=None)


@pytest.mark.parametrize("first", [0, 1])
def test_steps_from_rest_move_the_mass_as_a_pendulum_and_end_where_they_begin(standing: Plan, first: int) -> None:
    model, _ = prepare(standing, Conditions(), Drive())
    reference = WalkReference(standing, model, find_torque_limits(standing))
    steps = reference.make_steps_from_rest(first)
    assert [phase.swing for phase in steps.phases] == [None, first, None, 1 - first, None]
    swing, feet = steps.phases[1], steps.sample("feet", 0.0).reshape(2, 3)
    begin = steps.sample("dcm", 0.0)
    for start, stop in ((0.0, swing.start_s), (swing.start_s + 0.002, swing.end_s)):  # the ZMP jumps between them
        dcm = solve_ivp(
            lambda t, dcm: steps.rate * (dcm - steps.sample("zmp", t)),
            (start, stop),
            steps.sample("dcm", start),
            rtol=1e-8,
        ).y[:, -1]
        np.testing.assert_allclose(steps.sample("dcm", stop), dcm, atol=1e-4)
    np.testing.assert_allclose(steps.sample("dcm", steps.duration_s), reference.sample("zmp", 0.3), atol=1e-12)
    np.testing.assert_allclose(begin, reference.sample("zmp", 0.3), atol=0.01)  # pushed off by the foot that swings
    lifted = steps.sample("feet", (swing.start_s + swing.end_s) / 2).reshape(2, 3) - feet
    assert lifted[first, 2] > 0.01 and (np.delete(lifted, 3 * first + 2) == 0.0).all()


@pytest.mark.parametrize(
    ("impulse_Ns", "settings", "steps"), [(2.6, (1.0, 0.1), 0), (3.5, (1.0, 0.1), 1), (3.5, (0.2, 0.0), 0)]
)
def test_a_robot_at_rest_steps_where_no_zmp_brings_it_back_and_a_foothold_does(
    standing: Plan, impulse_Ns: float, settings: tuple[float, float], steps: int
) -> None:
    reach, error = settings
    push = Push(impulse_Ns=(impulse_Ns, 0.0), start_s=0.6, duration_s=0.1)
    run = SimulationRun(
        standing, Conditions(push=push), Drive(feedback=Balance(hold=0.0, reach=reach, step_error=error))
    )
    assert run.advance(0.6)
    balance = run._corrector
    assert isinstance(balance, WholeBodyBalance)
    before = balance.clock
    assert run.advance(0.95)
    assert (balance.clock is not before) == (steps == 1)
    assert (run.finish().stepped_at_s is not None) == (steps == 1)
    if steps:
        assert balance.find_plan_time(1.0) >= 0.3  # the plan waits


def advance(run: SimulationRun, until_s: float) -> Array:
    assert run.advance(until_s)
    return np.array(run.data.qpos)


@pytest.mark.commit
@pytest.mark.parametrize(("impulse_Ns", "share"), [((2.1, 0.0), 0.45), ((0.0, -1.8), 0.55)])
def test_a_pushed_walk_stands_with_it_and_falls_without(
    plan: Plan, impulse_Ns: tuple[float, float], share: float
) -> None:
    conditions = Conditions(push=Push(impulse_Ns=impulse_Ns, start_s=share * plan.duration_s, duration_s=0.1))
    alone, balanced = (
        SimulationRun(plan, conditions, drive).finish() for drive in (Drive(), Drive(feedback=Balance()))
    )
    assert alone.fell_at_s is not None and balanced.fell_at_s is None


def test_bumps_and_noise_act_and_the_same_seed_gives_the_same_walk(plan: Plan) -> None:
    noisy = Balance(noise=1.0, delay_s=0.004)
    first, again, other = (
        advance(SimulationRun(plan, Conditions(), Drive(feedback=balance)), 0.2)
        for balance in (noisy, noisy, replace(noisy, seed=1))
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    bumpy, flat = (
        advance(SimulationRun(plan, conditions), 0.5)
        for conditions in (Conditions(bumps=Bumps(height_m=0.004)), Conditions())
    )
    assert not np.array_equal(bumpy, flat)


def test_a_push_after_the_end_is_refused(standing: Plan) -> None:
    with pytest.raises(InputError, match=r"a push must begin from 0 s to the end of the simulation, 1.3 s, got 2 s"):
        SimulationRun(standing, Conditions(push=Push(impulse_Ns=(1.0, 0.0), start_s=2.0)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("period_s = 5.0", "period_s of a drive must be from"),
        ("period = 1", "unknown key 'period'"),
        ("[balance]\ndcm_gain = -1.0", "dcm_gain of a balance feedback must be from 0 to 1000, got -1.0"),
        ("[controller]\nkp = 1e308\nkd = 1", "kp of a controller must be from 1e-06 to 1e+09, got 1e+308"),
        ("[balance]\n[controller]\nkp = 1\nkd = 1", "a drive has a controller or a feedback, got both"),
        ("period_s = " + 400 * "9", "drive.toml': int too large to convert to float"),
        ("period_s = " + 3000 * "[", "drive.toml': maximum recursion depth exceeded"),
    ],
)
def test_settings_in_a_file_that_are_not_allowed_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(words)):
        load_drive(str(path))


def test_the_load_passes_from_foot_to_foot(plan: Plan) -> None:
    """In single support one foot has it all; in between, the point that divides their distance is nearest to the ZMP."""
    single, double, period = 0.4, 0.56565, 0.96565
    times = np.array([0.2, single + 0.25 * double, single + 0.75 * double, period + 0.2])
    feet = np.stack([plan.at(f"{side}_foot", times)[:, :2] for side in ("left", "right")])
    share = compute_left_load(plan, times, feet)
    assert share[0] == 1.0 > share[1] > share[2] > share[3] == 0.0
    nearest = share[1] * feet[0, 1] + (1.0 - share[1]) * feet[1, 1]
    np.testing.assert_allclose((nearest - plan.at("zmp", times)[1]) @ (feet[0] - feet[1])[1], 0.0, atol=1e-12)


def test_the_commands_take_feedback_and_conditions(cycle: Result, tmp_path: Path) -> None:
    result = tmp_path / "cycle.json"
    result.write_text(json.dumps({"problem": "nao-cycle", "x": cycle.problem.by_name(cycle.x)}))
    flags = ["--steps", "1", "--slope-deg=-3,0", "--stiffness-factor", "0.9"]

    def torques(*more: str) -> float:
        return float(as_json("simulate", result, *flags, *more)["walk"]["engine_J_per_planned_m"])

    assert torques("--feedback", "balance") != torques()
    assert "unknown feedback 'telepathy'" in one_sentence("simulate", result, "--feedback", "telepathy")
