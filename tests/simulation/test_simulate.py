"""Gaits in the engine."""

import dataclasses
import math

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.slow  # each gait is simulated

from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import measure  # noqa: E402
from nlp_gait.simulation.plan import make_plan  # noqa: E402
from nlp_gait.simulation.simulate import Conditions, Push, SimulationRun, simulate_plan  # noqa: E402

ONE_NEWTON_S = 1.0


@pytest.fixture(scope="module")
def simulated(gait):
    """Plan, trace and measurements by gait, each simulated once."""
    found = {}

    def get(name):
        if name not in found:
            plan = make_plan(gait(name))
            trace = simulate_plan(plan)
            found[name] = (plan, trace, measure(plan, trace, Drive()))
        return found[name]

    return get


@pytest.mark.parametrize("name", ["ssp optimum", "ssp pso", "dsp optimum"])
def test_published_gaits_and_optima_stay_up(simulated, name):
    plan, trace, m = simulated(name)
    assert not m.fallen and m.fell_at_s is None
    assert m.largest_tilt_deg < 3.0
    assert m.tracking_max_rad < 0.03
    assert m.slip_m < 0.006
    assert m.joint_limits == ()
    assert trace.t[-1] == pytest.approx(plan.duration_s + 1.0, abs=0.002)


def test_the_measured_power_is_the_predicted_one_and_keeps_the_order(simulated):
    optimum, pso, ga = (simulated(f"ssp {name}")[2] for name in ("optimum", "pso", "ga"))
    assert optimum.measured.mechanical_W == pytest.approx(optimum.predicted.mechanical_W, rel=0.10)
    assert optimum.measured.mechanical_W < pso.measured.mechanical_W < ga.measured.mechanical_W
    assert optimum.measured.total_W < pso.measured.total_W < ga.measured.total_W
    assert optimum.predicted.total_W == pytest.approx(0.846, abs=0.002)


def test_an_infeasible_gait_falls_and_is_reported(gait):
    plan = make_plan(gait("ssp falling"))
    sole_edge = 0.05 + plan.robot.feet["left"].left_m
    assert plan.signals.arrays["zmp"][:, 1].max() > sole_edge
    trace = simulate_plan(plan)
    m = measure(plan, trace, Drive())
    assert m.fallen and 0.5 < m.fell_at_s < 5.0
    assert m.largest_tilt_deg > 45.0
    assert dataclasses.asdict(m)["fallen"] is True


def test_a_push_moves_and_a_strong_one_fells(simulated):
    plan, _, m = simulated("dsp optimum")
    pushed = simulate_plan(plan, Conditions(push=Push(impulse_Ns=(ONE_NEWTON_S, 0.0))))
    assert pushed.fell_at_s is None
    assert math.degrees(pushed.tilt.max()) > m.largest_tilt_deg + 0.5
    assert simulate_plan(plan, Conditions(push=Push(impulse_Ns=(0.0, 10 * ONE_NEWTON_S)))).fell_at_s is not None


def test_a_short_push_changes_the_momentum_by_its_impulse(gait):
    """In a millisecond the ground's friction cannot give a tenth of it."""
    run = SimulationRun(make_plan(gait("dsp optimum")), Conditions(friction=0.3))
    run.advance(0.5)
    assert run.data.ncon > 0 and set(run.data.contact.friction[:, 0].tolist()) == {0.3}
    momenta = []
    for impulse in ((0.0, 0.0), (2.0, -1.0)):
        pushed = run.fork(Push(impulse_Ns=impulse, start_s=run.time_s, duration_s=1e-3))
        pushed.advance(run.time_s + 1e-3)
        mujoco.mj_forward(pushed.model, pushed.data)  # velocities after the last step
        mujoco.mj_subtreeVel(pushed.model, pushed.data)
        momenta.append(pushed.model.body_subtreemass[0] * pushed.data.subtree_linvel[0, :2])
    np.testing.assert_allclose(momenta[1] - momenta[0], (2.0, -1.0), rtol=0.1)


def test_slope_friction_and_mass_change_the_world(simulated):
    plan, flat, _ = simulated("dsp optimum")
    assert simulate_plan(plan, Conditions(slope_rad=(math.radians(35.0), 0.0))).fell_at_s is not None
    slippery = simulate_plan(plan, Conditions(friction=0.02, slope_rad=(math.radians(4.0), 0.0)))
    assert slippery.feet[-1, 0, 0] < flat.feet[-1, 0, 0] - 0.05  # slides down, that is backward
    heavy = simulate_plan(plan, Conditions(mass_factor=1.1))
    weight = plan.robot.mass_kg * plan.gravity
    assert heavy.loads[-200:].sum(axis=1).mean() == pytest.approx(1.1 * weight, rel=0.01)


def test_torque_limits_are_named_and_hold(simulated):
    plan = simulated("ssp optimum")[0]
    drive = Drive(torque_limits="continuous")
    trace = simulate_plan(plan, drive=drive)
    m = measure(plan, trace, drive)
    limits = np.array([drive.torque_limit(plan.robot.joint(name)) for name in plan.joints])
    assert (np.abs(trace.torque) <= limits + 1e-9).all()
    assert m.saturated and all(0.0 < share <= 1.0 for share in m.saturated.values())


def test_a_simulation_that_diverges_counts_as_a_fall_with_finite_numbers(simulated):
    plan = simulated("dsp optimum")[0]
    drive = Drive(full_error_rad=1e-9, torque_limits="stall")  # stiffer than any time step can follow
    trace = simulate_plan(plan, Conditions(mass_factor=1e-6), drive)
    assert trace.fell_at_s is not None
    assert np.isfinite(trace.q).all() and np.isfinite(trace.torque).all()
