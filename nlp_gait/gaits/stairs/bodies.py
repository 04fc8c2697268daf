"""The nine planar links as a tree of rigid bodies for the engine.

Both legs lie in one plane and pass through each other. A foot is a rod on the ground, ankle included; a plate above it touches
the stairs. The leg with primes, which stands first, is the left one.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import JOINTS as MODEL_JOINTS
from nlp_gait.gaits.stairs.planar_biped import LINKS, Rod
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GRAVITY
from nlp_gait.robots import Foot, Joint, Link, Robot
from nlp_gait.robots.robot import Vector

# The paper has no motors. The largest torque of each is the robot's weight at a lever as long as what the joint moves: leg,
# shank, foot, toe. NAO's motors give 0.8 to 1.6 times that at stall (hip pitch; knee and ankle).
FOOT_HALF_WIDTH = 0.05  # [m]; has no effect in the plane
RANGE = (-np.pi, np.pi)  # of every joint [rad]; the plans satisfy the paper's limits
RATE_LIMIT = 100.0  # [rad/s]; not used
TORSO = "torso"
# Links of a leg from the hip down, by the name of the joint before them, with the paper's name and the link in front.
LEG = {"Hip": ("thigh", "HK"), "Knee": ("shank", "KA"), "Ankle": ("sole", "AS"), "Toe": ("toe", "ST")}
SIDES = {"L": ("left", "'"), "R": ("right", "")}
JOINTS = tuple(f"{letter}{joint}" for letter in SIDES for joint in LEG)
# The model's joint for each of these, and whether it turns the same way; it has none for the toe that stands.
MODEL_JOINT = {
    "LHip": ("hip'", 1.0),
    "LKnee": ("knee'", -1.0),
    "LAnkle": ("ankle'", -1.0),
    "RHip": ("hip", 1.0),
    "RKnee": ("knee", 1.0),
    "RAnkle": ("ankle", 1.0),
    "RToe": ("toe", 1.0),
}


@cache
def rigid_bodies() -> Robot:
    """Return the tree from the torso, whose frame is at the hip; in the zero pose it stands upright with straight legs."""
    biped = toe_foot_biped()
    rods = biped.rods
    levers = {"Hip": rods["HK"].length + rods["KA"].length, "Knee": rods["KA"].length}
    levers |= {"Ankle": biped.foot_m, "Toe": biped.toe_m}
    links = {TORSO: _link(TORSO, rods["UH"], (0.0, 0.0, 1.0))}
    joints, feet, toes = {}, {}, {}
    for letter, (side, _) in SIDES.items():
        parent, origin = TORSO, (0.0, 0.0, 0.0)
        for joint, (part, paper_name) in LEG.items():
            rod, name = rods[paper_name], f"{side} {part}"
            along: Vector = (0.0, 0.0, -1.0) if joint in ("Hip", "Knee") else (1.0, 0.0, 0.0)
            links[name] = _link(name, rod, along)
            joints[f"{letter}{joint}"] = Joint(
                name=f"{letter}{joint}",
                parent=parent,
                child=name,
                origin_m=origin,
                axis=(0.0, 1.0, 0.0),
                limits_rad=RANGE,
                planning_limits_rad=RANGE,
                velocity_limit_rad_s=RATE_LIMIT,
                torque_limit_Nm=biped.mass_kg * GRAVITY * levers[joint],
            )
            parent, origin = name, (rod.length * along[0], rod.length * along[1], rod.length * along[2])
        feet[side], toes[side] = (_plate(f"{side} {part}", rods[of].length) for part, of in (LEG["Ankle"], LEG["Toe"]))
    return Robot(
        name=biped.name,
        description="Planar biped of nine rods with toes",
        sources={"masses and lengths": biped.source, "inertias": biped.inertia},
        root=TORSO,
        links=links,
        joints=joints,
        feet=feet,
        toes=toes,
    )


def joint_angles(q: Array, *, rates: bool = False) -> Array:
    """Return joint angles (T, 8) from absolute link angles (T, 9) in the order of ``LINKS``; with ``rates``, rates."""
    turned = _forward_turns(q, 0.0 if rates else 1.0)
    columns = []
    for _, mark in SIDES.values():
        before = "UH"
        for _part, paper_name in LEG.values():
            link = "".join(f"{end}{mark}" for end in paper_name).replace("H'", "H")
            columns.append(turned[link] - turned[before])
            before = link
    return np.stack(columns, axis=1)


def joint_torques(model: Array, stance_toe: Array) -> Array:
    """Return joint torques (T, 8) from ``loads``' (T, 7) and the standing toe's (T,), which these lack [Nm]."""
    found = {name: sense * model[:, MODEL_JOINTS.index(joint)] for name, (joint, sense) in MODEL_JOINT.items()}
    return np.stack([found.get(name, stance_toe) for name in JOINTS], axis=1)


def torso_lean(q: Array) -> Array:
    """Return the rotation (T,) of the torso from upright, forward [rad]."""
    return _forward_turns(q, 1.0)["UH"]


def _forward_turns(q: Array, share: float) -> dict[str, Array]:
    """Return the rotation of every link about the axis to the left from the zero pose; ``share`` 0 for rates."""
    upright = share * np.pi / 2
    zero = {"UH": -upright, "AS": 0.0, "ST": 0.0}
    turns = {}
    for i, link in enumerate(LINKS):
        sense = -1.0 if link == "UH" else 1.0
        turns[link] = sense * q[:, i] - zero.get(link.replace("'", ""), upright)
    return turns


def _link(name: str, rod: Rod, along: Vector) -> Link:
    """Return a rod from its frame's origin along an axis; equal inertia about all axes, as it turns about one only."""
    x, y, z = (rod.length / 2 * part for part in along)
    tensor = (rod.inertia, rod.inertia, rod.inertia, 0.0, 0.0, 0.0)
    return Link(name=name, mass_kg=rod.mass, com_m=(x, y, z), inertia_com_kgm2=tensor)


def _plate(link: str, length: float) -> Foot:
    half = FOOT_HALF_WIDTH
    return Foot(link=link, ankle_height_m=0.0, front_m=length, back_m=0.0, left_m=half, right_m=half)
