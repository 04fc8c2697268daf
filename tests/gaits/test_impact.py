"""Inelastic touch-down of a cycle: energy and momentum before and after against Pinocchio, and a soft landing loses nothing."""

import numpy as np
import pytest

from nlp_gait.formulation import Array, GaitProblem, Grid, Signals, load
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.cycle import make_walking_cycle
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.impact import Impact
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.humanoid.body import make_humanoid
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.robots import Robot
from tests.evaluation import evaluated
from tests.pinocchio_oracle import floating_model, move_base, pin

FOOT = "foot_vx_touch_down_m_s"
CASES = [("nao-cycle", make_nao), ("humanoid-cycle", make_humanoid)]


def keep_momentum(problem: GaitProblem, x: Array) -> Array:
    """Return x with the velocities after touch-down that keep the momentum, of which its rows are linear functions."""
    after = [k for k, name in enumerate(problem.names) if "_after_touch_down_" in name]

    def evaluate(rates: Array) -> tuple[Array, Array]:
        changed = x.copy()
        changed[after] = rates
        rows = evaluated(problem, changed).rows
        return changed, np.array([value for name, value in rows.items() if "_momentum_" in name])

    at_rest = evaluate(np.zeros(len(after)))[1]
    slopes = np.column_stack([evaluate(unit)[1] - at_rest for unit in np.eye(len(after))])
    changed, rest = evaluate(np.linalg.solve(slopes, -at_rest))
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)
    return changed


def measure(robot: Robot, signals: Signals, sample: int) -> tuple[float, Array]:
    """Return kinetic energy [J] and momentum (3,) [N s] of a robot that stands on its left sole."""
    model = floating_model(robot)
    data = model.createData()
    q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    for joint, angle, rate in zip(signals.joints, signals["q"][sample], signals["qd"][sample], strict=True):
        entry = model.joints[model.getJointId(joint)]
        q[entry.idx_q], v[entry.idx_v] = angle, rate
    move_base(model, data, model.getJointId("LAnkleRoll"), np.array([0.0, 0.05, 0.045]), (q, v, a))
    energy = float(pin.computeKineticEnergy(model, data, q, v))
    return energy, np.array(pin.computeCentroidalMomentum(model, data, q, v).linear)


def list_phases(problem: GaitProblem, body: Body, x: Array) -> list[Signals]:
    """Return both phases, each with its sample at the switch."""
    loads = make_divided_loads(body, "lever")
    impact = Impact(name="touch_down")
    cycle = make_walking_cycle(body, loads, Grid(intervals=10), Goal(), at_given_speed=False, touch_down=impact)
    return [phase.signals(problem.at(x)) for phase in cycle.phases.values()]


@pytest.mark.parametrize(("name", "make"), CASES)
def test_energy_and_momentum_before_and_after_are_pinocchios(name: str, make: type[Body]) -> None:
    problem, body = load(name, landing="inelastic"), make("nao-v5")
    for seed in range(3):
        x = problem.start_point(np.random.default_rng(seed))
        x[problem.variable_index(FOOT)] = 0.3
        x = keep_momentum(problem, x)
        single, double = list_phases(problem, body, x)
        np.testing.assert_allclose(double["q"][0], single["q"][-1], rtol=0, atol=1e-9)
        (before, momentum), (after, later) = measure(body.robot, single, -1), measure(body.robot, double, 0)
        indexes = evaluated(problem, x).indexes
        assert indexes["touch_down_energy_loss_J"] == pytest.approx(before - after, abs=1e-9) and before > after
        assert indexes["touch_down_impulse_Ns"] == pytest.approx(float(np.linalg.norm(later - momentum)), abs=1e-9)
        jump = np.abs(double["qd"][0] - single["qd"][-1]).max()
        assert indexes["touch_down_rate_jump_rad_s"] == pytest.approx(float(jump), rel=1e-9)


@pytest.mark.parametrize("name", ["nao-cycle", "humanoid-cycle"])
def test_a_soft_landing_loses_nothing_and_is_the_cycle_without_impact(name: str) -> None:
    problem, soft = load(name, landing="inelastic"), load(name)
    x = problem.start_point(np.random.default_rng(0))
    assert x[problem.variable_index(FOOT)] == 0.0
    x = keep_momentum(problem, x)
    values = dict(zip(problem.names, x, strict=True))
    for variable in problem.names:
        if "_after_touch_down_" in variable:
            assert values[variable] == pytest.approx(values[variable.replace("_after_", "_")], abs=1e-9)
    indexes = evaluated(problem, x).indexes
    assert indexes["touch_down_energy_loss_J"] == pytest.approx(0.0, abs=1e-12)
    without = evaluated(soft, [values[variable] for variable in soft.names])
    assert evaluated(problem, x).cost == pytest.approx(without.cost, rel=1e-9)
