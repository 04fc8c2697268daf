"""Newton-Euler torques and the ZMP: statics by hand, energy, and links that two trees share."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import TreeBody, make_tree, weld
from nlp_gait.symbolic.balance import LEAST_LOAD, combine_zmps, ground_load, zmp_of_wrench
from nlp_gait.symbolic.dynamics import Wrench, newton_euler, regroup_inertias
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics

GRAVITY = 9.8
ROBOT = weld(load_robot("nao-v5"), ("HeadYaw", "HeadPitch"))
FOOT = ROBOT.feet["left"]
TREE = make_tree(ROBOT, FOOT.link)
JOINTS = tuple(body.joint.name for body in TREE if body.joint is not None)
WEIGHT = ROBOT.mass_kg * GRAVITY
# Sums of some hundred products of order one in double precision.
TOLERANCE = 1e-11
# Central difference of an energy of some 20 J with a step of 1e-4 s: rounding 1e-11 W, truncation 1e-7 W.
ENERGY_STEP_S, POWER_TOLERANCE_W = 1e-4, 1e-5
SEEDS = range(4)


def by_name(q: SX) -> dict[str, SX]:
    return {name: q[i] for i, name in enumerate(JOINTS)}


def dynamics(tree: tuple[TreeBody, ...] = TREE, shares: dict[str, SX] | None = None) -> ca.Function:
    """(q, qd, qdd) to torques in the order of JOINTS (those of the tree), ground force and moment."""
    q, qd, qdd = (SX.sym(name, len(JOINTS)) for name in ("q", "qd", "qdd"))
    torques, wrench = newton_euler(tree, by_name(q), by_name(qd), by_name(qdd), GRAVITY, shares)
    columns = ca.vertcat(*(torques[name] for name in JOINTS if name in torques))
    return ca.Function("dynamics", [q, qd, qdd], [columns, *wrench])


def kinematics() -> ca.Function:
    """Q to the whole robot's centre of mass, and each body's centre of mass and rotation."""
    q = SX.sym("q", len(JOINTS))
    poses = forward_kinematics(TREE, by_name(q), SX(3, 1))
    outputs = [
        centre_of_mass(TREE, poses),
        ca.horzcat(*(p.com for p in poses)),
        ca.horzcat(*(p.rotation for p in poses)),
    ]
    return ca.Function("kinematics", [q], outputs)


DYNAMICS, KINEMATICS = dynamics(), kinematics()
ZERO = np.zeros(len(JOINTS))


def random_pose(seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, len(JOINTS))


@pytest.mark.parametrize("seed", SEEDS)
def test_at_rest_the_zmp_lies_under_the_centre_of_mass(seed: int) -> None:
    q = random_pose(seed)
    _, force, moment = DYNAMICS(q, ZERO, ZERO)
    com = np.array(KINEMATICS(q)[0]).ravel()
    assert np.array(force).ravel() == pytest.approx([0.0, 0.0, WEIGHT], abs=TOLERANCE)
    for height in (0.0, FOOT.ankle_height_m):  # without horizontal force the height does not matter
        zmp = zmp_of_wrench(Wrench(SX(force), SX(moment)), height, WEIGHT)
        assert np.array(ca.DM(zmp)).ravel() == pytest.approx(com[:2], abs=TOLERANCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_at_rest_torques_are_the_slope_of_the_potential_energy(seed: int) -> None:
    q = random_pose(seed)
    slope = ca.Function("slope", [s := SX.sym("q", len(JOINTS))], [ca.jacobian(KINEMATICS(s)[0][2], s)])
    torque = np.array(DYNAMICS(q, ZERO, ZERO)[0]).ravel()
    assert torque == pytest.approx(WEIGHT * np.array(slope(q)).ravel(), abs=TOLERANCE)


def energy(q: Array, qd: Array) -> float:
    """Kinetic and potential energy of all bodies [J], velocities by directional derivative of the poses."""
    s, r = SX.sym("q", len(JOINTS)), SX.sym("qd", len(JOINTS))
    _, coms, rotations = KINEMATICS(s)
    rates = ca.Function("rates", [s, r], [coms, rotations, ca.jtimes(coms, s, r), ca.jtimes(rotations, s, r)])
    c, R, cd, Rd = (np.array(value) for value in rates(q, qd))
    total = 0.0
    for i, body in enumerate(TREE):
        spin = R[:, 3 * i : 3 * i + 3].T @ Rd[:, 3 * i : 3 * i + 3]  # skew matrix of the angular velocity, body axes
        omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        mass = body.link.mass_kg
        total += 0.5 * mass * cd[:, i] @ cd[:, i] + mass * GRAVITY * c[2, i]
        total += 0.5 * omega @ body.link.inertia_matrix @ omega
    return total


@pytest.mark.parametrize("seed", SEEDS)
def test_with_a_fixed_foot_joint_power_is_the_rate_of_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    amplitude, frequency, phase = (rng.uniform(low, high, len(JOINTS)) for low, high in ((0, 1), (1, 3), (0, 6)))

    def motion(t: float) -> tuple[Array, Array, Array]:
        angle = frequency * t + phase
        return (
            amplitude * np.sin(angle),
            amplitude * frequency * np.cos(angle),
            -amplitude * frequency**2 * np.sin(angle),
        )

    q, qd, qdd = motion(0.3)
    before, after = (energy(*motion(0.3 + shift)[:2]) for shift in (-ENERGY_STEP_S, ENERGY_STEP_S))
    power = float(np.array(DYNAMICS(q, qd, qdd)[0]).ravel() @ qd)
    assert power == pytest.approx((after - before) / (2 * ENERGY_STEP_S), abs=POWER_TOLERANCE_W)
    assert abs(power) > 1.0  # there is something to compare


def test_two_trees_that_share_a_link_carry_the_whole_robot() -> None:
    """Both halves stand on the same foot frame's axes; at rest their ground forces add up to the weight."""
    halves = {
        side: make_tree(ROBOT, ROBOT.feet[foot].link, [name for name in JOINTS if name.startswith(side)])
        for side, foot in (("L", "left"), ("R", "right"))
    }
    loads = {
        side: float(dynamics(tree, {ROBOT.root: SX(share)})(ZERO, ZERO, ZERO)[1][2])
        for (side, tree), share in zip(halves.items(), (0.3, 0.7), strict=True)
    }
    assert sum(loads.values()) == pytest.approx(WEIGHT, abs=TOLERANCE)
    own = (WEIGHT / GRAVITY - ROBOT.links[ROBOT.root].mass_kg) / 2  # legs and arms weigh the same left and right
    assert loads["L"] / GRAVITY == pytest.approx(own + 0.3 * ROBOT.links[ROBOT.root].mass_kg, abs=TOLERANCE)


def test_a_share_of_a_link_is_a_link_of_that_mass_and_inertia() -> None:
    torso = ROBOT.links[ROBOT.root]
    lighter: Robot = replace(
        ROBOT,
        links={
            **ROBOT.links,
            ROBOT.root: replace(
                torso,
                mass_kg=0.25 * torso.mass_kg,
                inertia_com_kgm2=tuple(0.25 * v for v in torso.inertia_com_kgm2),  # type: ignore[arg-type]
            ),
        },
    )
    q, qd, qdd = (random_pose(seed) for seed in (1, 2, 3))
    shared = dynamics(TREE, {ROBOT.root: SX(0.25)})(q, qd, qdd)
    for value, expected in zip(shared, dynamics(make_tree(lighter, FOOT.link))(q, qd, qdd), strict=True):
        np.testing.assert_allclose(np.array(value), np.array(expected), rtol=0, atol=TOLERANCE)


def test_a_robot_without_shared_links_pays_nothing_for_the_possibility() -> None:
    assert dynamics(TREE, {}).n_instructions() == DYNAMICS.n_instructions()


def test_zmp_of_a_point_mass_by_hand() -> None:
    """2 kg at (0.1, 0.2, 0.5) accelerated by (1, -2, 0.2): ZMP = p - z a / (g + az) across."""
    mass, p, a = 2.0, np.array([0.1, 0.2, 0.5]), np.array([1.0, -2.0, 0.2])
    force = mass * (a + [0.0, 0.0, GRAVITY])
    reference = np.array([0.0, 0.0, 0.05])
    wrench = Wrench(SX(ca.DM(force)), SX(ca.DM(np.cross(p - reference, force))))
    zmp = np.array(ca.DM(zmp_of_wrench(wrench, 0.05, mass * GRAVITY))).ravel()
    assert zmp == pytest.approx([0.1 - 0.5 * 1.0 / 10.0, 0.2 + 0.5 * 2.0 / 10.0], abs=TOLERANCE)


def test_in_free_fall_the_zmp_is_far_away_and_finite() -> None:
    wrench = Wrench(SX([1.0, 0.0, 0.0]), SX([0.0, -1.0, 0.0]))
    assert float(ground_load(wrench, 50.0)) == 50.0 * LEAST_LOAD
    assert float(zmp_of_wrench(wrench, 0.0, 50.0)[0]) == pytest.approx(20.0)


def test_the_combined_zmp_is_the_load_weighted_mean_and_ignores_an_unloaded_foot() -> None:
    feet = [SX([0.0, 0.1]), SX([0.2, -0.1])]
    assert np.array(ca.DM(combine_zmps(feet, [SX(10), SX(30)]))).ravel() == pytest.approx([0.15, -0.05])
    assert np.array(ca.DM(combine_zmps(feet, [SX(10), SX(0)]))).ravel() == pytest.approx([0.0, 0.1])


def test_regrouping_leaves_mass_in_the_first_body_only_and_none_along_the_axes() -> None:
    first, *others = regroup_inertias(TREE)
    assert first.mass == pytest.approx(ROBOT.mass_kg)
    for body, inertia in zip(TREE[1:], others, strict=True):
        assert body.joint is not None
        axis = np.array(body.joint.axis)
        assert inertia.mass == 0.0
        assert axis @ inertia.first == pytest.approx(0.0, abs=1e-15)
        assert axis @ inertia.second @ axis == pytest.approx(0.0, abs=1e-15)


def test_links_that_are_kept_neither_give_nor_take() -> None:
    plain = {body.link.name: inertia for body, inertia in zip(TREE, regroup_inertias(TREE), strict=True)}
    names = [body.link.name for body in TREE]
    kept = dict(zip(names, regroup_inertias(TREE, kept=["torso"]), strict=True))
    assert kept["torso"].mass == pytest.approx(ROBOT.links["torso"].mass_kg)
    for body in TREE[1:]:
        beside = "torso" in (body.link.name, TREE[body.parent].link.name)
        assert (kept[body.link.name].mass > 0.0) == beside
        assert plain[body.link.name].mass == 0.0


def test_to_know_what_stays_upright_saves_operations() -> None:
    q, qd, qdd = (SX.sym(name, len(JOINTS)) for name in ("q", "qd", "qdd"))
    counts = [
        ca.Function(
            "torques",
            [q, qd, qdd],
            list(newton_euler(TREE, by_name(q), by_name(qd), by_name(qdd), GRAVITY, upright=upright)[0].values()),
        ).n_instructions()
        for upright in ((), (ROBOT.root,))
    ]
    assert counts[1] < counts[0]
