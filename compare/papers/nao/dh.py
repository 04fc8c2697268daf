"""Tables 1, 2 and 4, Denavit-Hartenberg parameters of the legs and an arm, against our robot."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from compare.papers.nao.results import FOLDER
from compare.papers.paper import read_rows
from nlp_gait.formulation import Array
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics
from nlp_gait.symbolic.rotations import axis_rotation

POSTURES = 20
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def measure_tables(robot: str = "nao-v5") -> dict[str, float]:
    """Return the largest distance of each chain's end from our robot's over random postures [mm]."""
    loaded, rng = load_robot(robot), np.random.default_rng(0)
    limits = np.array([joint.limits_rad for joint in loaded.joints.values()])
    postures = rng.uniform(limits[:, 0], limits[:, 1], (POSTURES, len(limits)))
    misses = dict[str, float]()
    for row in read_rows(FOLDER / "dh.csv"):
        place = _make_placement(loaded, row["end"])
        gaps = []
        for posture in postures:
            ours = np.array(place(posture))
            ours = np.linalg.inv(ours) if row["from_foot"] == "yes" else ours
            angles = {name: int(row["sense"]) * angle for name, angle in zip(loaded.joints, posture, strict=True)}
            gaps.append(float(np.linalg.norm((ours - _follow_chain(row["steps"], angles))[:3, 3])))
        misses[f"{row['words']} [mm]"] = max(gaps)
    return misses


def measure_stretched_height(robot: str = "nao-v5") -> float:
    """Return the height of the torso above the sole of a stretched leg [m]."""
    loaded = load_robot(robot)
    return -float(_make_placement(loaded, loaded.feet["left"].link)(np.zeros(len(loaded.joints)))[2, 3]) / 1000


def _make_placement(robot: Robot, link: str) -> ca.Function:
    """Return the frame (4, 4) of a link in the torso's axes [mm], of a foot that of its sole, as a function of all angles."""
    tree, q = make_tree(robot, robot.root), ca.SX.sym("q", len(robot.joints))
    poses = forward_kinematics(tree, dict(zip(robot.joints, ca.vertsplit(q), strict=True)), ca.SX(3, 1))
    pose = poses[[body.link.name for body in tree].index(link)]
    sole = sum(foot.ankle_height_m for foot in robot.feet.values() if foot.link == link)
    place = 1000 * (pose.position - sole * pose.rotation[:, 2])
    return ca.Function("place", [q], [ca.vertcat(ca.horzcat(pose.rotation, place), ca.DM([[0, 0, 0, 1]]))])


def _follow_chain(steps: str, angles: Mapping[str, float]) -> Array:
    """Return the frame at the end of a chain [mm]: steps ``move x y z``, ``turn axis HALF_TURNS``, ``JOINT offset d alpha a``."""
    frame = np.eye(4)
    for step in steps.split("; "):
        kind, *rest = step.split()
        if kind == "move":
            frame = frame @ _move(*map(float, rest))
        elif kind == "turn":
            frame = frame @ _turn(rest[0], np.pi * float(rest[1]))
        else:
            offset, d, alpha, a = map(float, rest)
            turned = _turn("z", angles[kind] + np.pi * offset) @ _move(0.0, 0.0, d)
            frame = frame @ turned @ _turn("x", np.pi * alpha) @ _move(a, 0.0, 0.0)  # (1)
    return frame


def _turn(axis: str, angle: float) -> Array:
    frame = np.eye(4)
    frame[:3, :3] = np.array(ca.DM(axis_rotation(AXES[axis], ca.SX(angle))))
    return frame


def _move(x: float, y: float, z: float) -> Array:
    frame = np.eye(4)
    frame[:3, 3] = x, y, z
    return frame
