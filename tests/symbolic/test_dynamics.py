"""Regrouped inertias and saved operations of the recursion, whose torques tests/gaits and tests/simulation check."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import make_tree, weld
from nlp_gait.symbolic.dynamics import newton_euler, regroup_inertias

GRAVITY = (0.0, 0.0, -9.8)
ROBOT = weld(load_robot("nao-v5"), ("HeadYaw", "HeadPitch"))
FOOT = ROBOT.feet["left"]
TREE = make_tree(ROBOT, FOOT.link)
JOINTS = tuple(body.joint.name for body in TREE if body.joint is not None)


def by_name(q: SX) -> dict[str, SX]:
    return {name: q[i] for i, name in enumerate(JOINTS)}


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
