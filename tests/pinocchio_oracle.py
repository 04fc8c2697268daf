"""Independent robot dynamics with Pinocchio: the natural tree with a free-flyer at the torso.

The package sees the robot from the foot outwards; here the torso floats, the foot stands still, and the ground's wrench follows
from the six rows of the base, which no motor drives.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import pytest

from nlp_gait.formulation import Array, Signals
from nlp_gait.gaits.nao.body import GRAVITY
from nlp_gait.robots import Link, Robot

pin = pytest.importorskip("pinocchio")  # needs NumPy 2


class Standing(NamedTuple):
    """What a robot on one foot needs."""

    torques: dict[str, float]  #: by joint name [Nm]
    zmp: Array  #: (2,) in the world [m], from the rate of the momentum about the origin
    ground_load: float  #: vertical force of the ground [N]
    com: Array  #: (3,) [m]
    torso: Array  #: (3,) position of the torso [m]


def inertia(link: Link, share: float = 1.0) -> pin.Inertia:
    """Pinocchio's record of a link."""
    ixx, iyy, izz, ixy, ixz, iyz = link.inertia_com_kgm2
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    return pin.Inertia(share * link.mass_kg, np.array(link.com_m), share * tensor)


def floating_model(robot: Robot, share: float = 1.0, prefix: str = "") -> pin.Model:
    """Free-flyer at the torso; head and torso weigh ``share`` of themselves; only joints with the prefix (and the head)."""
    model = pin.Model()
    torso = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), robot.root)
    model.appendBodyToJoint(torso, inertia(robot.links[robot.root], share), pin.SE3.Identity())
    indexes = {robot.root: torso}
    waiting = list(robot.joints.values())
    while waiting:
        joint = waiting.pop(0)
        is_head = joint.name.startswith("Head")
        if not (is_head or joint.name.startswith(prefix)):
            continue
        if joint.parent not in indexes:
            waiting.append(joint)
            continue
        placement = pin.SE3(np.eye(3), np.array(joint.origin_m))
        revolute = pin.JointModelRevoluteUnaligned(np.array(joint.axis))
        index = model.addJoint(indexes[joint.parent], revolute, placement, joint.name)
        link = robot.links[joint.child]
        model.appendBodyToJoint(index, inertia(link, share if is_head else 1.0), pin.SE3.Identity())
        indexes[joint.child] = index
    return model


def move_base(model: pin.Model, data: pin.Data, foot: int, place: Array, motion: tuple[Array, Array, Array]) -> Array:
    """Pose, velocity and acceleration of the base, written into a motion (q, v, a), from a foot that stands still.

    Args:
        model: with a free-flyer.
        data: of the model; holds the kinematics of the whole motion afterwards.
        foot: index of the joint above the foot, which has the world's axes.
        place: (3,) of that joint [m].
        motion: its joints' entries are given.

    Returns:
        (6, nv) the foot's Jacobian.
    """
    q, v, a = motion
    pin.forwardKinematics(model, data, q)
    base = pin.SE3(np.eye(3), place) * data.oMi[foot].inverse()
    q[:3], q[3:7] = base.translation, pin.Quaternion(base.rotation).coeffs()
    pin.computeJointJacobians(model, data, q)
    jacobian: Array = pin.getJointJacobian(model, data, foot, pin.LOCAL_WORLD_ALIGNED)
    v[:6] = -np.linalg.solve(jacobian[:, :6], jacobian[:, 6:] @ v[6:])
    pin.forwardKinematics(model, data, q, v, a)
    drift = pin.getAcceleration(model, data, foot, pin.LOCAL_WORLD_ALIGNED).vector
    a[:6] = -np.linalg.solve(jacobian[:, :6], drift)
    return jacobian


def stand(
    model: pin.Model,
    ankle_joint: str,
    ankle: Array,
    q: Mapping[str, float],
    qd: Mapping[str, float],
    qdd: Mapping[str, float],
    gravity: float,
) -> Standing:
    """Torques of a robot whose ankle link stands still with world axes at ``ankle`` (3,); missing joints rest at zero."""
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    data = model.createData()
    names = list(model.names)[2:]  # without the universe and the free-flyer
    q0, v0, a0 = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    for name in names:
        joint = model.joints[model.getJointId(name)]
        q0[joint.idx_q] = q.get(name, 0.0)
        v0[joint.idx_v] = qd.get(name, 0.0)
        a0[joint.idx_v] = qdd.get(name, 0.0)
    jacobian = move_base(model, data, model.getJointId(ankle_joint), ankle, (q0, v0, a0))

    # The six base rows give the wrench on the foot; its share of the joint rows is the rest.
    generalised = pin.rnea(model, data, q0, v0, a0)
    wrench = np.linalg.solve(jacobian[:, :6].T, generalised[:6])
    torques = generalised[6:] - jacobian[:, 6:].T @ wrench

    pin.computeCentroidalMomentumTimeVariation(model, data, q0, v0, a0)
    mass, com, rate = pin.computeTotalMass(model), data.com[0], data.dhg
    force = rate.linear + np.array([0.0, 0.0, mass * gravity])
    moment = rate.angular + np.cross(com, force)
    return Standing(
        torques={name: float(torques[model.joints[model.getJointId(name)].idx_v - 6]) for name in names},
        zmp=np.array([-moment[1], moment[0]]) / force[2],
        ground_load=float(force[2]),
        com=np.array(com),
        torso=np.array(q0[:3]),
    )


def left_over(robot: Robot, signals: Signals, sample: int, gravity: float, stance: str = "L") -> Array:
    """What equations of motion with both wrenches as forces from outside leave: base rows first, then joints [N, Nm].

    The foot on the side ``stance`` stands flat and still.
    """
    model = floating_model(robot)
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    data = model.createData()
    q, v, a, tau = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
    for joint, *values in zip(
        signals.joints, *(signals.arrays[k][sample] for k in ("q", "qd", "qdd", "tau")), strict=True
    ):
        entry = model.joints[model.getJointId(joint)]
        q[entry.idx_q], v[entry.idx_v], a[entry.idx_v], tau[entry.idx_v] = values
    stands, foot = model.getJointId(f"{stance}AnkleRoll"), {"L": "left", "R": "right"}[stance]
    height = np.array([0.0, 0.0, robot.feet[foot].ankle_height_m])
    move_base(model, data, stands, signals.arrays[f"{foot}_foot"][sample] + height, (q, v, a))
    forces = pin.StdVec_Force()
    for _ in range(model.njoints):
        forces.append(pin.Force.Zero())
    for side, foot in (("L", "left"), ("R", "right")):
        index = model.getJointId(f"{side}AnkleRoll")
        # The placement of the foot's axes in the world, at the point under its ankle.
        below = pin.SE3(np.eye(3), signals.arrays[f"{foot}_foot"][sample])
        wrench = pin.Force(signals.arrays[f"{foot}_force"][sample], signals.arrays[f"{foot}_moment"][sample])
        forces[index] = data.oMi[index].actInv(below.act(wrench))
    driven = [model.joints[model.getJointId(joint)].idx_v for joint in signals.joints]  # the head is locked
    return np.asarray((pin.rnea(model, data, q, v, a, forces) - tau)[[*range(6), *driven]])


# Two double-precision algorithms on torques of up to some hundred Nm and a ZMP that divides by a force, and on places.
ROUNDING, PLACES_M = 1e-8, 1e-12
SOLE_Y_M = {"L": 0.05, "R": -0.05}  # of NAO


def read_state(signals: Signals, sample: int) -> tuple[dict[str, float], ...]:
    """Angles, rates and accelerations by joint."""
    return tuple(
        dict(zip(signals.joints, signals.arrays[name][sample].tolist(), strict=True)) for name in ("q", "qd", "qdd")
    )


def check_standing(signals: Signals, model: pin.Model, ankle: Array, samples: Iterable[int], *places: str) -> None:
    """Compare torques, ZMP and these places, of com and hip, of NAO on its left foot."""
    for sample in samples:
        oracle = stand(model, "LAnkleRoll", ankle, *read_state(signals, sample), GRAVITY)
        expected = [oracle.torques[joint] for joint in signals.joints]
        np.testing.assert_allclose(signals.arrays["tau"][sample], expected, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(signals.arrays["zmp"][sample], oracle.zmp, rtol=0, atol=ROUNDING)
        for place, at in (("com", oracle.com), ("hip", oracle.torso)):
            if place in places:
                np.testing.assert_allclose(signals.arrays[place][sample], at, rtol=0, atol=PLACES_M)


def check_halves(signals: Signals, robot: Robot, rule: str, left_x: float, right_x: float) -> None:
    """Compare torques and ZMP of NAO in double support with two halves, each of which floats and stands on its foot."""
    checked = 0
    for sample in range(11):
        near_left = (signals.arrays["hip"][sample, 1] + 0.05) / 0.1  # 1 above the left foot, 0 above the right one
        if not 0.0 < near_left < 1.0:
            continue  # no body has a negative mass
        left_share = near_left if rule == "lever" else 1.0 - near_left
        halves: dict[str, Standing] = {}
        for side, share, x in (("L", left_share, left_x), ("R", 1.0 - left_share, right_x)):
            ankle = np.array([x, SOLE_Y_M[side], robot.feet["left"].ankle_height_m])
            model = floating_model(robot, share, prefix=side)
            halves[side] = stand(model, f"{side}AnkleRoll", ankle, *read_state(signals, sample), GRAVITY)
        expected = [halves[joint[0]].torques[joint] for joint in signals.joints]
        np.testing.assert_allclose(signals.arrays["tau"][sample], expected, rtol=0, atol=ROUNDING)
        loads = np.array([half.ground_load for half in halves.values()])
        if (loads > 1.0).all():  # below a thousandth of the weight the model takes that share
            zmp = sum(half.zmp * half.ground_load for half in halves.values()) / loads.sum()
            np.testing.assert_allclose(signals.arrays["zmp"][sample], zmp, rtol=0, atol=ROUNDING)
            checked += 1
    assert checked > 0
