"""The closed loop: finite at every gain, honest about standing still, and one optimum for search and multiple shooting."""

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX

import nlp_gait
from metaheuristics import AntColony, minimize
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.stairs.track import _compute_margin
from nlp_gait.symbolic.nonsmooth import Exact
from tests.evaluation import evaluated

# Stiff gains follow the plan of case 2 within 0.05 rad.
FOLLOWED_RAD = 0.05
# Power of a falling, whipping robot without damping, mean over the rollout [W], and a hundred times the distance of its ZMP,
# whose force points sideways [m]; a robot that walks takes about 50 W.
LARGEST_COST = 1e9
# A millimetre at the ankle, on knees bent by at least 0.5 rad; what rates of up to 3 rad/s change, and the cost (relative).
NETWORK_ANGLE_RAD, NETWORK_RATE_RAD_S, NETWORK_COST = 1e-2, 0.05, 0.01
# The archive of ants and IPOPT end within this of each other (relative).
AGREEMENT = 1e-5
# To compile the derivatives takes longer than a short rollout's solve.
INTERPRETED = nlp_gait.IpoptSettings(compiled=False)


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("stairs-track")


def test_stiff_gains_follow_the_plan(problem: GaitProblem) -> None:
    found = evaluated(problem, [1000.0, 1000.0, 1.463])
    assert found.violation == 0.0
    assert found.metrics["largest_error_rad"] < FOLLOWED_RAD
    assert found.metrics["zmp_margin_min_m"] > 0.0


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_finite_at_every_gain(problem: GaitProblem, share: float) -> None:
    """However little holds the robot up; what falls undamped costs more than any robot could spend, and is infeasible."""
    gains = np.linspace(0.0, 100.0, 6)
    X = np.array([[kp, kd, torso] for kp in gains for kd in gains for torso in (0.8, 1.2, 1.45, 1.75)])
    f, violation = nlp_gait.compile_objective(problem.with_values(gravity_compensation=share))(X)
    assert f.max() < LARGEST_COST
    assert np.isfinite(violation).all()
    assert (violation[X[:, 1] == 0.0] > 0.0).all()


def test_the_margin_is_the_least_distance_from_both_ends() -> None:
    zmp, rear, front = (MX(DM(values)) for values in ([0.02, 0.05], [-0.1, 0.0], [0.12, 0.12]))
    assert float(ca.evalf(_compute_margin(zmp, rear, front, Exact()))) == pytest.approx(0.05)


def test_the_zmp_limits_are_constraints(problem: GaitProblem) -> None:
    """At a torso pitch where the ZMP leaves the foot."""
    x = [100.0, 100.0, 1.6]
    found = evaluated(problem, x)
    margin = found.metrics["zmp_margin_min_m"]
    assert margin < -1e-3
    assert found.violation > 0.0
    arrays = problem.signals(np.array(x)).arrays
    polygon = np.where(arrays["t"] < 0.7783, 0.17 - 0.254, 0.0)
    outside = np.maximum(polygon - arrays["zmp"], arrays["zmp"] - 0.17)
    assert outside.max() == pytest.approx(-margin)
    assert evaluated(problem.with_values(zmp_weight=0.0), x).cost - 100.0 * margin == pytest.approx(found.cost)


def test_joint_torques_and_angles_of_the_same_motion() -> None:
    """Stiff gains give the same motion in both coordinates; there joint torques do the work of the printed ones."""
    joint, printed = (
        nlp_gait.load("stairs-track", coordinates=name, duration_s=0.3).signals(np.array([1e4, 1e4, 1.45])).arrays
        for name in ("joint", "printed")
    )
    link = joint["link_q"]
    assert printed["link_q"] == pytest.approx(link, abs=2e-3)
    knee = link[:, 1] - link[:, 0]
    assert joint["q"][:, 1] == pytest.approx(knee, abs=1e-12)  # (27)
    assert printed["q"][:, 1] == pytest.approx(knee, abs=4e-3)
    assert printed["q"][:, 5:7] == pytest.approx(link[:, 5:7], abs=4e-3)
    power = [(part["tau"] * part["qd"]).sum(axis=1)[5:] for part in (joint, printed)]
    assert power[0] == pytest.approx(power[1], abs=0.5)


def test_a_held_hip_is_followed_by_soft_legs_without_compensation() -> None:
    """The paper's base and six contacts: the stance leg carries nothing, and gains like those of Table IV follow."""
    held, standing = (
        nlp_gait.load("stairs-track", base=base, duration_s=0.3).with_values(gravity_compensation=0.0)
        for base in ("hip", "stance-foot")
    )
    soft, fallen = (evaluated(problem, [43.0, 5.0, 1.59]).metrics for problem in (held, standing))
    assert soft["largest_error_rad"] < 0.5 * fallen["largest_error_rad"]
    assert soft["peak_torque_Nm"] < 0.5 * fallen["peak_torque_Nm"]


def test_the_printed_zmp_has_no_spin_and_one_slope(problem: GaitProblem) -> None:
    """The virtual slope moves the ZMP only where the robot accelerates forward, and only in single support."""
    x = np.array([100.0, 100.0, 1.45])
    ours = problem.signals(x).arrays
    spin, slope = (
        problem.with_values(**change).signals(x).arrays["zmp"]
        for change in ({"spin_in_zmp": 0.0}, {"slope_in_single_support": 1.0})
    )
    single = ours["t"] >= 0.7783
    assert np.abs(slope - ours["zmp"])[~single].max() == 0.0
    assert 1e-4 < np.abs(slope - ours["zmp"])[single].max() < 0.1
    assert 1e-4 < np.abs(spin - ours["zmp"]).max() < 0.1


@pytest.mark.usefixtures("without_compiler")
def test_multiple_shooting_meets_the_ants() -> None:
    """On the first 0.04 s, which solve in a second."""
    short = nlp_gait.load("stairs-track", duration_s=0.04)
    solution = nlp_gait.solve(short, x0=[60.0, 60.0, 1.4], solver=INTERPRETED)
    assert solution.converged, solution.status
    found = minimize(nlp_gait.compile_objective(short), AntColony(), evaluations=1_000, seed=0)
    assert found.feasible
    assert found.objective == pytest.approx(solution.objective, rel=AGREEMENT)


def test_the_network_in_place_of_the_closed_form(problem: GaitProblem) -> None:
    learned, x = nlp_gait.load("stairs-track", inverse_kinematics="network"), [100.0, 100.0, 1.45]
    cost, known = evaluated(learned, x).cost, evaluated(problem, x).cost
    assert 0.0 < abs(cost - known) < NETWORK_COST * known
    found, exact = (p.signals(np.array(x)).arrays for p in (learned, problem))
    error, rates = (np.abs(found[name] - exact[name]).max(axis=0) for name in ("q_desired", "qd_desired"))
    legs = np.arange(9) < 6
    assert (error[legs] > 0.0).all()
    assert error.max() < NETWORK_ANGLE_RAD
    assert error[~legs].max() == rates[~legs].max() == 0.0 < rates[legs].max() < NETWORK_RATE_RAD_S
