"""What is drawn of NAO: trunk, legs, arms and soles, by forward kinematics from the torso."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.stick_figure import LEFT, RIGHT, TRUNK, Limb, Skeleton, make_flat_skeleton
from nlp_gait.gaits.biped.skeleton import level_sole
from nlp_gait.gaits.biped.skeleton import skeleton as any_skeleton
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.kinematics import forward_kinematics

DRAWN = {"Neck", "Head", *(f"{side}{link}" for side in "LR" for link in ("Pelvis", "Tibia", "Shoulder", "Elbow"))}
DRAWN |= {"l_wrist", "r_wrist"}
LETTER = {LEFT: "L", RIGHT: "R"}


def skeleton(robot: Robot) -> Callable[[Signals, Mapping[str, float]], Skeleton]:
    """What draws a robot with NAO's links; one that has others is drawn as any biped."""
    if not DRAWN <= set(robot.links):
        return any_skeleton(robot)
    return lambda signals, parameters: _skeleton(robot, signals)


def _skeleton(robot: Robot, signals: Signals) -> Skeleton:
    arrays = signals.arrays
    at = _link_origins(robot, signals)
    torso, neck = at[robot.root], at["Neck"]
    shoulders = (at["LShoulder"] + at["RShoulder"]) / 2
    limbs = [Limb(side=TRUNK, points=np.stack([torso, shoulders, neck, at["Head tip"]], axis=1))]
    soles = []
    for side, letter in LETTER.items():
        foot = robot.feet[side]
        leg = [torso, *(at[f"{letter}{link}"] for link in ("Pelvis", "Tibia")), at[foot.link]]
        arm = [shoulders, *(at[f"{letter}{link}"] for link in ("Shoulder", "Elbow")), at[f"{letter.lower()}_wrist tip"]]
        sole_centre = arrays[f"{side}_foot"]
        limbs += [Limb(side=side, points=np.stack(part, axis=1)) for part in ([*leg, sole_centre], arm)]
        soles.append(level_sole(robot, side, sole_centre))
    return make_flat_skeleton(signals, limbs, soles)


def _link_origins(robot: Robot, signals: Signals) -> dict[str, Array]:
    """World positions (T, 3) of every link's joint, and of the tips of head and hands; head joints at zero."""
    q = SX.sym("q", len(signals.joints))
    hip = SX.sym("hip", 3)
    angles = {name: SX(0) for name in robot.joints} | {name: q[i] for i, name in enumerate(signals.joints)}
    tree = tree_from(robot, robot.root)
    poses = forward_kinematics(tree, angles, hip)
    named = {body.link.name: pose.position for body, pose in zip(tree, poses, strict=True)}
    named |= {f"{body.link.name} tip": pose.com for body, pose in zip(tree, poses, strict=True)}
    function = ca.Function("origins", [q, hip], list(named.values()))
    values = function.map(len(signals.arrays["t"]))(signals.arrays["q"].T, signals.arrays["hip"].T)
    return {name: np.array(value.full().T) for name, value in zip(named, values, strict=True)}
