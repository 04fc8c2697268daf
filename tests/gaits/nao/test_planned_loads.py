"""Double support whose load is planned: against Pinocchio, corner forces, and SciPy's polynomials."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from scipy.interpolate import BPoly
from scipy.optimize import linprog

import nlp_gait
from nlp_gait.formulation import Array, GaitProblem, Signals, load
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.cycle import make_walking_cycle
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import RAMP_SHARE, load_basis, share_load
from nlp_gait.gaits.nao.body import GRAVITY, make_nao
from nlp_gait.robots import load_robot
from nlp_gait.symbolic.balance import sole_limits
from tests.backends.toys import row_violations
from tests.evaluation import evaluated
from tests.pinocchio_oracle import left_over

# Two double-precision algorithms on torques of some Nm and forces of some ten N.
TORQUE_TOLERANCE_NM = FORCE_TOLERANCE_N = 1e-10
# The same sums in another order.
ROUNDING = 1e-12
SAMPLES = 11
FEASIBLE = {
    "nao-dsp": (0.31, 0.00683, 0.00007, 0.00485, 0.06828, -0.05291, -0.02170, 2.0),
    "nao-dsp-free": (0.30, 0.006, 0.0006, 0.03, 0.03, -0.05, -0.05, 1.0),
}
OPTIONS: dict[str, dict[str, str | int]] = {
    "nao-dsp": {"samples_per_interval": 1},
    "nao-dsp-free": {"trajectory": "spline-2", "samples_per_interval": 1},
    "nao-cycle": {"objective": "power", "samples_per_interval": 1},
}


@cache
def problem_of(name: str) -> GaitProblem:
    return load(name, torso_share="free", **OPTIONS[name])


def candidate(name: str, seed: int = 0) -> Array:
    """A motion that closes, with a load somewhere near one that passes evenly."""
    problem, rng = problem_of(name), np.random.default_rng(seed)
    x = problem.start_point(rng)
    if name in FEASIBLE:
        own = FEASIBLE[name]
        x[: len(own)] = own
    for i, variable in enumerate(problem.names):
        if variable.startswith("right_"):
            x[i] += 0.05 * rng.normal() * problem.scale[i]
        elif variable.startswith("torso_"):
            x[i] = 0.2 * rng.normal()
    return x


def double_support(name: str, x: Array) -> Signals:
    problem = problem_of(name)
    if name != "nao-cycle":
        return problem.signals(x)
    body = make_nao("nao-v5")
    assert problem.grid is not None
    cycle = make_walking_cycle(body, share_load(body, "free"), problem.grid, Goal(), at_given_speed=True)
    return cycle.phases[Support.DOUBLE].signals(cycle.read_section(cycle.sections[1], problem.at(x)))


@pytest.mark.slow
@pytest.mark.parametrize("name", list(OPTIONS))
@pytest.mark.parametrize("seed", range(2))
def test_torques_are_pinocchios_with_the_wrenches_as_outer_forces(name: str, seed: int) -> None:
    """The base rows say that both wrenches carry the robot, the joint rows that the torques are right."""
    robot, signals = load_robot("nao-v5"), double_support(name, candidate(name, seed))
    assert np.ptp(signals.arrays["right_force"][:, 2]) > 10.0
    for sample in range(SAMPLES):
        rest = left_over(robot, signals, sample, GRAVITY)
        np.testing.assert_allclose(rest, 0.0, rtol=0, atol=TORQUE_TOLERANCE_NM)


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["printed", "lever"])
def test_the_papers_divisions_show_their_wrenches_too(rule: str) -> None:
    problem = load("nao-dsp", torso_share=rule)
    signals = problem.signals(np.array(FEASIBLE["nao-dsp"]))
    for sample in range(SAMPLES):
        np.testing.assert_allclose(
            left_over(load_robot("nao-v5"), signals, sample, GRAVITY), 0.0, atol=TORQUE_TOLERANCE_NM
        )


@pytest.mark.slow
def test_the_division_leaves_motion_and_zmp_alone() -> None:
    """Only torques differ: with the wrench that a rule has, the plan has that rule's torques."""
    x, free = candidate("nao-dsp"), problem_of("nao-dsp")
    ruled = load("nao-dsp", torso_share="lever").signals(x[:8])
    mine = free.signals(x)
    for name in ("q", "qd", "qdd", "hip", "com", "zmp"):
        np.testing.assert_allclose(mine.arrays[name], ruled.arrays[name], rtol=0, atol=ROUNDING * 10, err_msg=name)
    both = [sum(s.arrays[f"{foot}_force"] for foot in ("left", "right")) for s in (mine, ruled)]
    np.testing.assert_allclose(both[0], both[1], rtol=0, atol=FORCE_TOLERANCE_N)
    phases = np.linspace(0.0, 1.0, 11)
    forces = np.hstack([ruled.arrays["right_force"], ruled.arrays["right_moment"]])
    table = BPoly(np.eye(11)[:, None, :], [0.0, 1.0])(phases)
    matched = load("nao-dsp", torso_share="free", samples_per_interval=1, load_degree=10)
    coefficients = np.vstack([np.linalg.solve(table, forces), np.zeros((2, 6))])  # without ramps
    same = matched.signals(np.concatenate([x[:8], coefficients.T.ravel()]))
    np.testing.assert_allclose(same.arrays["tau"], ruled.arrays["tau"], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_derivatives_of_the_paper_take_the_planned_wrench_too() -> None:
    problem = load("nao-dsp", torso_share="free", derivatives="finite-difference", samples_per_interval=1)
    signals = problem.signals(candidate("nao-dsp"))
    analytic = problem_of("nao-dsp").signals(candidate("nao-dsp"))
    np.testing.assert_array_equal(signals.arrays["right_force"], analytic.arrays["right_force"])
    power = np.abs(signals.arrays["tau"] * signals.arrays["qd"]) + 0.025 * signals.arrays["tau"] ** 2
    t = signals.arrays["t"]
    cost = evaluated(problem, candidate("nao-dsp")).cost
    assert cost == pytest.approx(np.trapezoid(power.sum(axis=1), t) / t[-1], rel=ROUNDING)


def test_polynomials_are_scipys_and_ramps_end_smoothly() -> None:
    s = SX.sym("s")
    function = ca.Function("basis", [s], [load_basis(5, s)])
    phases = np.linspace(0.0, 1.0, 21)
    mine = np.array(function.map(21)(phases[None, :])).T
    theirs = BPoly(np.eye(6)[:, None, :], [0.0, 1.0])(phases)
    np.testing.assert_allclose(mine[:, :6], theirs, rtol=0, atol=1e-14)
    np.testing.assert_allclose(mine[:, 6], np.maximum(0.0, 1.0 - phases / RAMP_SHARE) ** 3, rtol=0, atol=1e-14)
    np.testing.assert_allclose(mine[::-1, 7], mine[:, 6], rtol=0, atol=1e-12)


@pytest.mark.slow
def test_a_sole_bears_what_forces_at_its_corners_can_give() -> None:
    """Random wrenches: the rows hold if and only if four corner forces, each within its pyramid, add up to it."""
    along, across, mu = (-0.04, 0.09), (-0.03, 0.05), 0.5
    wrench = SX.sym("wrench", 6)
    limits = ca.Function("limits", [wrench], [ca.vertcat(*sole_limits(wrench, along, across, SX(mu)))])
    corners = [(x, y) for x in along for y in across]
    arms = np.hstack([_turned(np.array([x, y, 0.0])) for x, y in corners])
    sums = np.vstack([np.tile(np.eye(3), 4), arms])
    slope = mu / np.sqrt(2.0)
    pyramid = np.array([[1, 0, -slope], [-1, 0, -slope], [0, 1, -slope], [0, -1, -slope]])
    rng, seen = np.random.default_rng(0), {True: 0, False: 0}
    for _ in range(300):
        load_N = rng.uniform(5.0, 50.0)
        w = np.array([0.2, 0.2, 1.0, 0.05, 0.06, 0.03]) * rng.uniform(-1, 1, 6) * load_N
        w[2], w[4] = load_N, w[4] - 0.025 * load_N
        least = float(ca.mmin(limits(w)))
        if abs(least) < 1e-6:
            continue
        found = linprog(
            np.zeros(12), A_ub=np.kron(np.eye(4), pyramid), b_ub=np.zeros(16), A_eq=sums, b_eq=w, bounds=(None, None)
        )
        assert found.success == (least > 0), (w, least)
        seen[least > 0] += 1
    assert min(seen.values()) > 20


def _turned(arm: Array) -> Array:
    """(3, 3) matrix of the moment that a force at a point has."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@pytest.mark.slow
def test_a_load_that_jumps_or_pulls_breaks_rows() -> None:
    problem, x = problem_of("nao-dsp").with_values(switch_load_limit=0.1), candidate("nao-dsp")
    names = list(problem.names)
    x[names.index("right_force_z_N[0]")] = 40.0
    x[[i for i, name in enumerate(names) if name.startswith("right_force_x")]] = 25.0
    broken = {row.name.partition("[")[0] for row in row_violations(problem, x)}
    assert {"switch_load", "right_friction"} <= broken
    x[[i for i, name in enumerate(names) if name.startswith("right_force_z")]] = -5.0
    assert "right_pressure" in {row.name.partition("[")[0] for row in row_violations(problem, x)}


# Least power of nao-dsp with planned loads, 0.30617 W, to six digits.
CHEAPEST = np.fromstring(
    """
    0.31 0.00274928 0.000955305 0.032593 0.0560729 -0.035874 -0.0223844 2 -2.29164 -2.46703 -1.32289
    -4.80015 0.00303331 -0.0518306 -0.0754693 -0.679271 0.274358 -0.12674 0.114025 -1.81597 -0.0045626
    0.206923 21.0474 26.1971 23.5883 32.313 35.6611 0.220489 0.104912 0.263201 0.108428 -0.205433
    0.028733 0.0715443 0.00723454 -0.00438887 -0.105184 -0.158147 -0.0967936 -0.290152 -0.0578748
    -0.0028202 -0.0022675 0.301807 0.187196 0.21765 0.262832 0.104895 -0.00478015 -0.0080193
    """,
    sep=" ",
)


@pytest.mark.slow
def test_nothing_breaks_between_samples() -> None:
    """The optimum of 41 samples on 1,001 of them: what soles bear, and how fast load passes."""
    problem = load("nao-dsp", torso_share="free", samples_per_interval=100)
    found = evaluated(problem, CHEAPEST)
    assert found.cost == pytest.approx(0.3063, abs=2e-4)
    assert found.cost < 0.67 * 0.4630  # the lever rule's
    broken = [row.name for row in row_violations(problem, CHEAPEST) if row.name.startswith(("left", "right", "load"))]
    assert not broken


@pytest.mark.slow
@pytest.mark.usefixtures("without_compiler")
def test_the_kernel_of_searches_has_the_same_values() -> None:
    problem = load("nao-dsp", torso_share="free")
    points = np.array([CHEAPEST, problem.start_point(np.random.default_rng(1))])
    costs, violations = nlp_gait.compile_objective(problem)(points)
    for k, x in enumerate(points):
        exact = evaluated(problem, x)
        assert costs[k] == pytest.approx(exact.cost, rel=1e-9)
        assert violations[k] == pytest.approx(exact.violation, rel=1e-9, abs=1e-9)
