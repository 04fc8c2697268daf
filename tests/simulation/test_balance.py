"""Balance of the whole body: footholds in closed form, torques against the engine, and walks that open loop does not survive."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result
from nlp_gait.simulation.footholds import StepLimits, choose_step, clip_to_soles, find_shift
from nlp_gait.simulation.plan import Plan, make_plan

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("daqp")

from nlp_gait.simulation.balance import Balance  # noqa: E402
from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.engine import Addresses  # noqa: E402
from nlp_gait.simulation.mjcf import Bumps  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Push, Run, prepare  # noqa: E402
from nlp_gait.simulation.walk_reference import WalkReference  # noqa: E402
from nlp_gait.simulation.whole_body import Targets, WholeBodyQP  # noqa: E402

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
    time, shift = choose_step(np.array([0.06, 0.0]), 0.4, 0.15, 0.52, LIMITS, 0.06)
    assert time < 0.4 and 0.0 < shift[0] < LIMITS.shift_high[0] and shift[1] == 0.0
    time, shift = choose_step(np.array([0.15, -0.06]), 0.4, 0.15, 0.52, LIMITS, 0.06)
    assert time == 0.15 and shift.tolist() == [LIMITS.shift_high[0], LIMITS.shift_low[1]]


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


def test_torques_and_wrenches_give_the_accelerations_in_the_engine(plan: Plan) -> None:
    model, data = prepare(plan, Conditions(), Drive(), "rectangle")
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    addresses = Addresses(model, plan)
    limits = np.array([plan.robot.joint(name).torque_limit_Nm for name in plan.joints])
    qp = WholeBodyQP(WalkReference(plan, model, limits), model, addresses, limits, friction=0.5)
    data.qvel[:] = np.random.default_rng(1).normal(0.0, 0.1, model.nv)
    mujoco.mj_forward(model, data)
    weight = plan.robot.mass_kg * plan.gravity
    targets = Targets(
        mass=np.array([0.2, -0.1, 0.3]),
        torso=np.zeros(3),
        feet=np.zeros((2, 6)),
        stands=(True, True),
        joints=np.zeros(len(limits)),
        load_left=0.5,
        most_load=(3.0 * weight, 3.0 * weight),
    )
    solution = qp.solve(data, targets)
    assert solution is not None and (np.abs(solution.torques) <= limits).all()
    data.qfrc_applied[:] = 0.0
    data.qfrc_applied[addresses.rates] = solution.torques
    for sole, wrench in zip(addresses.soles, solution.wrenches.reshape(2, 6), strict=True):
        axes = data.site_xmat[sole].reshape(3, 3)
        force, moment = axes @ wrench[:3], axes @ wrench[3:]
        mujoco.mj_applyFT(model, data, force, moment, data.site_xpos[sole], model.site_bodyid[sole], data.qfrc_applied)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc[addresses.rates], solution.accelerations, rtol=1e-6, atol=1e-5)
    forces = solution.wrenches.reshape(2, 6)[:, 2]
    assert forces.sum() == pytest.approx(weight * (1.0 + 0.3 / plan.gravity), rel=0.05) and (forces > 0.0).all()


def advance(run: Run) -> Array:
    assert run.advance(0.8)
    return np.array(run.data.qpos)


@pytest.mark.slow
@pytest.mark.parametrize(("impulse_Ns", "share"), [((2.1, 0.0), 0.45), ((0.0, 2.1), 0.55), ((0.0, -1.8), 0.55)])
def test_a_pushed_walk_stands_with_it_and_falls_without(
    plan: Plan, impulse_Ns: tuple[float, float], share: float
) -> None:
    conditions = Conditions(push=Push(impulse_Ns=impulse_Ns, start_s=share * plan.duration_s, duration_s=0.1))
    alone, balanced = (Run(plan, conditions, drive).finish() for drive in (Drive(), Drive(balance=Balance())))
    assert alone.fell_at_s is not None and balanced.fell_at_s is None


@pytest.mark.slow
def test_bumps_noise_and_delay_act_and_the_same_seed_gives_the_same_walk(plan: Plan) -> None:
    settings = Balance(noise=1.0, delay_s=0.004)
    bumpy = Conditions(bumps=Bumps(height_m=0.004))
    first, again, other, flat = (
        advance(Run(plan, conditions, Drive(balance=balance)))
        for conditions, balance in (
            (bumpy, settings),
            (bumpy, settings),
            (bumpy, replace(settings, seed=1)),
            (Conditions(), settings),
        )
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other) and not np.array_equal(first, flat)


def test_settings_that_are_not_allowed_are_refused() -> None:
    for name, value in (("dcm_gain", -1.0), ("edge", float("nan")), ("period_s", 2.0)):
        with pytest.raises(InputError, match=f"{name} of a balance feedback must be"):
            Balance(**{name: value})
    with pytest.raises(InputError, match="a drive has one of controller, feedback and balance"):
        from nlp_gait.simulation.feedback import Feedback

        Drive(balance=Balance(), feedback=Feedback())
