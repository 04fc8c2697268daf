"""Our robot's geometry against forward kinematics from the NAO paper's tables of Denavit-Hartenberg parameters."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics
from nlp_gait.symbolic.rotations import axis_rotation

POSTURES = 20
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def compare_geometry(robot: str) -> dict[str, float]:
    """Return the largest distance of each chain's end from our robot's over random postures [mm], by the chain's words."""
    loaded, rng = load_robot(robot), np.random.default_rng(0)
    tables = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    limits = np.array([joint.limits_rad for joint in loaded.joints.values()])
    drawn = rng.uniform(limits[:, 0], limits[:, 1], (POSTURES, len(limits)))
    found = {}
    for table in tables.values():
        chain = {**tables.get(table.get("like"), {}), **table}
        place = _make_placement(loaded, chain["of"])
        gaps = []
        for angles in drawn:
            ours = np.array(place(angles))
            ours = np.linalg.inv(ours) if chain["from_foot"] else ours
            printed = _follow_chain(chain["steps"], chain["sense"], dict(zip(loaded.joints, angles, strict=True)))
            gaps.append(float(np.linalg.norm(ours[:3, 3] - printed[:3, 3])))
        found[chain["words"]] = max(gaps)
    return found


def _make_placement(robot: Robot, link: str) -> ca.Function:
    """Return the frame (4, 4) of a link in the torso's axes [mm], of a foot that of its sole, as a function of all angles."""
    tree, q = make_tree(robot, robot.root), ca.SX.sym("q", len(robot.joints))
    poses = forward_kinematics(tree, dict(zip(robot.joints, ca.vertsplit(q), strict=True)), ca.SX(3, 1))
    pose = poses[[body.link.name for body in tree].index(link)]
    heights = [foot.ankle_height_m for foot in robot.feet.values() if foot.link == link]
    place = pose.position - sum(heights) * pose.rotation[:, 2]
    last = ca.SX([0, 0, 0, 1]).T
    return ca.Function("place", [q], [ca.vertcat(ca.horzcat(pose.rotation, 1000 * place), last)])


def _follow_chain(steps: Sequence[str], sense: int, angles: Mapping[str, float]) -> Array:
    """Return the frame at the end of a chain [mm]."""
    printed = np.eye(4)
    for step in steps:
        kind, *rest = step.split()
        if kind == "move":
            printed = printed @ _move(*map(float, rest))
        elif kind == "turn":
            printed = printed @ _turn(rest[0], np.pi * float(rest[1]))
        else:
            offset, d, alpha, a = map(float, rest[1:])
            turned = _turn("z", sense * angles[rest[0]] + np.pi * offset) @ _move(0.0, 0.0, d)
            printed = printed @ turned @ _turn("x", np.pi * alpha) @ _move(a, 0.0, 0.0)  # (1)
    return printed


def _turn(axis: str, angle: float) -> Array:
    return _make_frame(np.array(ca.DM(axis_rotation(AXES[axis], ca.SX(angle)))), np.zeros(3))


def _move(x: float, y: float, z: float) -> Array:
    return _make_frame(np.eye(3), np.array([x, y, z]))


def _make_frame(rotation: Array, position: Array) -> Array:
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation, position
    return frame
