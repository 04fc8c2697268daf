"""The engine's own inverse dynamics of a planned motion: an oracle for the model's torques."""

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.formulation import Array, Signals
from nlp_gait.gaits.nao.body import GRAVITY
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import TreeBody, make_tree
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.mjcf import add_bodies


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
