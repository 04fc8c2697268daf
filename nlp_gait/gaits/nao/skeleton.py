"""Stick figure of NAO: trunk, legs, arms and soles."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from nlp_gait.formulation import Signals
from nlp_gait.formulation.display import LEFT, RIGHT, TRUNK, Limb, Skeleton, make_flat_skeleton
from nlp_gait.gaits.biped import skeleton
from nlp_gait.robots import Robot

DRAWN = {"Neck", "Head", *(f"{side}{link}" for side in "LR" for link in ("Pelvis", "Tibia", "Shoulder", "Elbow"))}
DRAWN |= {"l_wrist", "r_wrist"}
LETTER = {LEFT: "L", RIGHT: "R"}


def make_skeleton(robot: Robot) -> Callable[[Signals, Mapping[str, float]], Skeleton]:
    """Return the function that draws a robot with NAO's links; a robot with other links is drawn as any biped."""
    if not DRAWN <= set(robot.links):
        return skeleton.make_skeleton(robot)
    return lambda signals, parameters: _draw(robot, signals)


def _draw(robot: Robot, signals: Signals) -> Skeleton:
    arrays = signals.arrays
    at = skeleton.locate_links(robot, signals)
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
        soles.append(skeleton.make_level_sole(robot, side, sole_centre))
    return make_flat_skeleton(signals, limbs, soles)
