"""The engine's own inverse dynamics of a planned motion: an oracle for the model's torques."""

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree as Xml

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Result, Signals
from nlp_gait.gaits.biped.loads import share_torso
from nlp_gait.gaits.biped.samples import BOTH_FEET
from nlp_gait.gaits.nao.body import GRAVITY
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import TreeBody, make_tree
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.mjcf import add_bodies


def engine_torques(result: Result, signals: Signals) -> Array:
    """Torques (T, J) that MuJoCo needs for the planned angles, rates and accelerations, supporting feet fixed [Nm].

    A phase on one foot is one tree. In double support the model parts the robot in two, each half on its own foot with a share
    of the torso (eqs. 28, 29); so does this.

    Args:
        result: gait of ``nao-ssp`` or ``nao-dsp``, with rotational inertia: an engine takes no point masses.
        signals: its time histories.
    """
    options, model = result.problem.options, result.problem.display.simulation_model
    assert model is not None  # a gait of NAO has one; for the type checker
    robot = model.robot
    torques = np.zeros_like(signals.arrays["tau"])
    if result.problem.name == "nao-ssp":
        _fill(torques, make_tree(robot, robot.feet["left"].link), signals)
        return torques
    hip = SX.sym("hip")
    feet_y = (float(signals.arrays["left_foot"][0, 1]), float(signals.arrays["right_foot"][0, 1]))
    by_side = share_torso(hip, options["torso_share"], feet_y)  # type: ignore[arg-type]
    for side, foot in BOTH_FEET.items():
        tree = make_tree(robot, robot.feet[foot].link, [j for j in signals.joints if j.startswith(side)])
        share = ca.Function("share", [hip], [by_side[side]])(signals.arrays["hip"][:, 1]).full().ravel()
        _fill(torques, tree, signals, robot.root, share)
    return torques


def _fill(
    torques: Array, tree: Sequence[TreeBody], signals: Signals, shared: str | None = None, share: Array | None = None
) -> None:
    """Write the torques of a tree's joints into their columns; ``share`` (T,) scales mass and inertia of one link."""
    engine = load_mujoco()
    model = engine.MjModel.from_xml_string(fixed_model(tree))
    data = engine.MjData(model)
    columns = [signals.joints.index(model.joint(i).name) for i in range(model.njnt)]
    body = None if shared is None else model.body(shared)
    whole = None if body is None else (float(body.mass[0]), body.inertia.copy())
    for k in range(len(torques)):
        if body is not None and whole is not None and share is not None:
            body.mass[0], body.inertia[:] = share[k] * whole[0], share[k] * whole[1]
        data.qpos[:], data.qvel[:], data.qacc[:] = (signals.arrays[name][k, columns] for name in ("q", "qd", "qdd"))
        engine.mj_inverse(model, data)
        torques[k, columns] = data.qfrc_inverse


def standing_on(
    robot: Robot, gravity: float, side: str, signals: Signals, forces: Mapping[str, Array] | None = None
) -> tuple[Array, Array]:
    """Torques (T, J) that MuJoCo needs with one foot still, and the wrench (T, 6) of the ground on it about its ankle.

    Args:
        robot: any tree.
        gravity: [m/s^2].
        side: of the foot that stands.
        signals: angles, rates and accelerations.
        forces: of the ground (T, 3) [N] on the frame of each of these links, beyond its sole's front.
    """
    engine, forces = load_mujoco(), forces or {}
    model = engine.MjModel.from_xml_string(fixed_model(make_tree(robot, robot.feet[side].link), gravity))
    data = engine.MjData(model)
    columns = [signals.joints.index(model.joint(i).name) for i in range(model.njnt)]
    torques, wrench = np.zeros_like(signals.arrays["q"]), np.zeros((len(signals.arrays["t"]), 6))
    for k in range(len(torques)):
        data.qpos[:], data.qvel[:], data.qacc[:] = (signals.arrays[name][k, columns] for name in ("q", "qd", "qdd"))
        engine.mj_inverse(model, data)
        engine.mj_rnePostConstraint(model, data)
        moment, force = data.cfrc_int[1, :3], data.cfrc_int[1, 3:]  # about the centre of mass of all
        wrench[k] = *force, *(moment + np.cross(data.subtree_com[1], force))
        needed = data.qfrc_inverse.copy()
        for link, force_on in forces.items():
            body = model.body(link).id
            tip = data.xpos[body] + data.xmat[body].reshape(3, 3) @ (robot.soles[link].front_m, 0.0, 0.0)
            given = np.zeros(model.nv)
            engine.mj_applyFT(model, data, force_on[k], np.zeros(3), tip, body, given)
            needed -= given
        torques[k, columns] = needed
    return torques, wrench


def fixed_model(tree: Sequence[TreeBody], gravity: float = GRAVITY) -> str:
    """Masses and joints alone, the tree's first body welded to the world: the robot that planned torques belong to."""
    root = Xml.fromstring(
        '<mujoco><compiler angle="radian"/><option><flag constraint="disable"/></option><worldbody/></mujoco>'
    )
    root[1].set("gravity", f"0 0 {-gravity!r}")
    add_bodies(root[2], tree, {}, root="fixed")
    return Xml.tostring(root, encoding="unicode")
