"""Load sharing in a given motion: against SciPy at single instants, Pinocchio, the lever rule, and its own limits."""

from __future__ import annotations

import builtins
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from typer.testing import CliRunner

from compare.cli import app
from nlp_gait.errors import InputError, MissingExtraError
from nlp_gait.formulation import Array, Result, load
from nlp_gait.robots import load_robot
from nlp_gait.simulation import load_sharing
from nlp_gait.simulation.load_sharing import (
    Sharing,
    Support,
    compute_instants,
    find_double_supports,
    make_sole_rows,
    share_loads,
)
from nlp_gait.simulation.plan import Plan, make_plan

from tests.pinocchio_oracle import left_over  # isort: skip  # first: the tests of the cycle need Pinocchio too
from tests.gaits.nao.test_cycle import OPTIMUM
from tests.properties.mirror import JOINT_SIGNS, partner

# Two double-precision algorithms on torques of some Nm.
TORQUE_TOLERANCE_NM = 1e-10
# An interior-point method and SciPy's SLSQP on one convex problem: relative power, and rows in N and Nm.
OPTIMUM_TOLERANCE, ROW_TOLERANCE = 1e-5, 1e-6
K = 0.025


def cycle(steps: int | None = None) -> Plan:
    problem = load("nao-cycle", objective="power").with_values(speed_m_s=0.03)
    return make_plan(Result(problem=problem, x=np.array([OPTIMUM[name] for name in problem.names])), steps)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return cycle()


@pytest.fixture(scope="module")
def support(plan: Plan) -> Support:
    (found,) = find_double_supports(plan.signals)
    return found


@pytest.fixture(scope="module")
def shared(plan: Plan, support: Support) -> Plan:
    """Every sample on its own: as many knots as samples."""
    times = plan.signals.arrays["t"][support.first : support.last + 1]
    return share_loads(plan, Sharing(period_s=(1 + 1e-9) * float(times[-1] - times[0]) / (len(times) - 1)))


def power(plan: Plan) -> Array:
    """At every sample [W]."""
    tau, rate = plan.signals.arrays["tau"], plan.signals.arrays["qd"]
    return np.asarray((np.abs(tau * rate) + K * tau**2).sum(axis=1))


def wrenches(plan: Plan, side: str, samples: slice) -> Array:
    arrays = plan.signals.arrays
    return np.hstack([arrays[f"{side}_force"], arrays[f"{side}_moment"]])[samples]


@pytest.mark.slow
def test_double_support_begins_after_the_landing(plan: Plan, support: Support) -> None:
    t, times = plan.signals.arrays["t"], [OPTIMUM[f"{phase}_support_time_s"] for phase in ("single", "double")]
    assert t[support.first - 1] == pytest.approx(times[0])
    assert t[support.last] == pytest.approx(sum(times))
    assert (support.landed, support.lifting) == ("right", None)


@pytest.mark.slow
def test_with_the_levers_wrench_it_has_the_levers_torques(plan: Plan, support: Support) -> None:
    samples = slice(support.first, support.last + 1)
    instants, right = compute_instants(plan, samples), wrenches(plan, "right", samples)
    torque = instants.torque - np.einsum("njk,nk->nj", instants.gain, right)
    np.testing.assert_allclose(torque, plan.signals.arrays["tau"][samples], rtol=0, atol=TORQUE_TOLERANCE_NM)
    left = instants.left - np.einsum("njk,nk->nj", instants.carried, right)
    np.testing.assert_allclose(left, wrenches(plan, "left", samples), rtol=0, atol=TORQUE_TOLERANCE_NM)


@pytest.mark.slow
def test_no_instant_costs_more_than_by_the_lever_rule(plan: Plan, support: Support, shared: Plan) -> None:
    rule, mine = power(plan), power(shared)
    during = np.arange(support.first, support.last + 1)
    np.testing.assert_array_equal(np.delete(mine, during), np.delete(rule, during))
    assert (mine[during] <= rule[during] * (1 + OPTIMUM_TOLERANCE)).all()
    assert mine[during].mean() < 0.99 * rule[during].mean()


@pytest.mark.slow
def test_it_is_scipys_optimum_at_single_instants(plan: Plan, support: Support, shared: Plan) -> None:
    for sample in np.linspace(support.first, support.last, 2).astype(int).tolist():
        one = slice(sample, sample + 1)
        torque, gain, left, carried = (part[0] for part in compute_instants(plan, one))
        rate, rows = plan.signals.arrays["qd"][sample], make_sole_rows(plan.robot, Sharing().friction)
        driven = np.flatnonzero(np.abs(gain).max(axis=1) > 0)

        def cost(z: Array, torque: Array = torque, gain: Array = gain, driven: Array = driven) -> float:
            return float(z[6:].sum() + K * ((torque - gain @ z[:6])[driven] ** 2).sum())

        def slope(z: Array, torque: Array = torque, gain: Array = gain, driven: Array = driven) -> Array:
            heat = -2 * K * gain[driven].T @ (torque - gain @ z[:6])[driven]
            return np.concatenate([heat, np.ones(len(driven))])

        own, work, wide = gain[driven] * rate[driven, None], (torque * rate)[driven], np.eye(len(driven))
        none = np.zeros((16, len(driven)))
        matrix = np.vstack(
            [
                np.hstack([own, wide]),
                np.hstack([-own, wide]),
                np.hstack([rows["right"], none]),
                np.hstack([-rows["left"] @ carried, none]),
            ]
        )
        least = np.concatenate([work, -work, np.zeros(16), -rows["left"] @ left])
        start = np.concatenate([wrenches(plan, "right", one)[0], np.abs(work) + 1.0])
        found = minimize(
            cost,
            start,
            jac=slope,
            method="SLSQP",
            constraints={"type": "ineq", "fun": lambda z, m=matrix, b=least: m @ z - b, "jac": lambda z, m=matrix: m},
            options={"maxiter": 1000, "ftol": 1e-12},
        )
        assert found.success, found.message
        rest = np.delete(np.abs(torque * rate) + K * torque**2, driven).sum()
        assert power(shared)[sample] == pytest.approx(found.fun + rest, rel=OPTIMUM_TOLERANCE)


@pytest.mark.slow
def test_soles_bear_it_and_pinocchio_agrees(plan: Plan, support: Support, shared: Plan) -> None:
    samples = slice(support.first, support.last + 1)
    for side, rows in make_sole_rows(plan.robot, Sharing().friction).items():
        assert (wrenches(shared, side, samples) @ rows.T).min() > -ROW_TOLERANCE
    for sample in np.linspace(support.first, support.last, 7).astype(int).tolist():
        rest = left_over(load_robot("nao-v5"), shared.signals, sample, plan.gravity)
        np.testing.assert_allclose(rest, 0.0, rtol=0, atol=TORQUE_TOLERANCE_NM)


@pytest.mark.slow
def test_ramps_hold_and_steps_are_mirror_images() -> None:
    """Three steps: the second double support is the image of the first one; the last foot has none to lift after it."""
    rate, three = 20.0, cycle(steps=3)
    plan = share_loads(three, Sharing(load_rate_1_s=rate))
    first, second, last = find_double_supports(plan.signals)
    assert [(s.landed, s.lifting) for s in (first, second, last)] == [
        ("right", "left"),
        ("left", "right"),
        ("right", None),
    ]
    arrays, weight = plan.signals.arrays, plan.robot.mass_kg * plan.gravity
    for support in (first, second):
        samples = slice(support.first, support.last + 1)
        slowest = 1.02 * rate * np.diff(arrays["t"][samples])  # loads are not quite linear between knots
        for side in ("left", "right"):
            assert (np.abs(np.diff(arrays[f"{side}_force"][samples, 2])) <= weight * slowest).all()
        assert arrays[f"{support.landed}_force"][support.first, 2] <= weight * rate * 0.0101
        assert arrays[f"{support.lifting}_force"][support.last, 2] <= weight * rate * 0.0101
    columns = [plan.joints.index(partner(name)) for name in plan.joints]
    signs = np.array([JOINT_SIGNS[name] for name in plan.joints])
    image = signs * arrays["tau"][second.first : second.last + 1, columns]
    np.testing.assert_allclose(arrays["tau"][first.first : first.last + 1], image, rtol=0, atol=1e-2)
    for support in (first, second):
        middle = (support.first + support.last) // 2
        rest = left_over(load_robot("nao-v5"), plan.signals, middle, plan.gravity)
        np.testing.assert_allclose(rest, 0.0, rtol=0, atol=TORQUE_TOLERANCE_NM)


@pytest.mark.slow
def test_what_cannot_be_shared_is_reported(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no division of the load keeps both soles flat between 0.4.* s"):
        share_loads(plan, Sharing(friction=1e-4))
    with pytest.raises(InputError, match="no double support"):
        problem = load("nao-ssp")
        x = np.array([0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4.0])
        share_loads(make_plan(Result(problem=problem, x=x)))
    with pytest.raises(InputError, match="friction of a sharing of load must be > 0"):
        Sharing(friction=0.0)
    real = builtins.__import__

    def without(name: str, *arguments: Any) -> Any:
        if name == "clarabel":
            raise ImportError("No module named 'clarabel'")
        return real(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match="nlp-gait\\[qp\\]"):
        share_loads(plan)


@pytest.mark.slow
def test_the_command_shares_load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Power that the model predicts falls, more so where load may jump."""
    pytest.importorskip("mujoco")
    problem = load("nao-dsp", torso_share="lever")
    x = np.array([0.31, 0.00683, 0.00007, 0.00485, 0.06828, -0.05291, -0.02170, 1.0])
    file = tmp_path / "best.json"
    options = {"torso_share": "lever"}
    file.write_text(json.dumps({"problem": "nao-dsp", "options": options, "x": problem.by_name(x)}))
    found, shared = [], []

    def record(plan: Plan, sharing: Sharing) -> Plan:
        shared.append((plan, sharing, share_loads(plan, sharing)))
        return shared[-1][-1]

    monkeypatch.setattr(load_sharing, "share_loads", record)
    for more in ([], ["--share-loads", "--load-rate", "0.5"]):
        done = CliRunner().invoke(app, ["simulate", str(file), "--json", *more])
        assert done.exit_code == 0, done.output
        found.append(json.loads(done.stdout))
    predicted = [sum(report["predicted"][part] for part in ("mechanical_W", "heat_W")) for report in found]
    ((plan, sharing, slowly),) = shared
    assert sharing == Sharing(load_rate_1_s=0.5)
    slow, jumping = power(slowly).mean(), power(share_loads(plan, Sharing())).mean()
    assert predicted[0] > predicted[1] == pytest.approx(slow, rel=1e-2) and slow > jumping
    assert not any(report["fallen"] for report in found)
