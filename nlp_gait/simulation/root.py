"""How a robot's root moves in the engine: freely, or in the sagittal plane."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.simulation.plan import Plan

# Two translations and a rotation, in the order of the engine's coordinates.
PLANAR_JOINTS = {"root x": ("slide", "1 0 0"), "root z": ("slide", "0 0 1"), "root pitch": ("hinge", "0 1 0")}


def add_root_joints(element: Xml.Element, planar: bool) -> None:
    """Let a body move against the world."""
    if not planar:
        Xml.SubElement(element, "freejoint")
        return
    for name, (kind, axis) in PLANAR_JOINTS.items():
        Xml.SubElement(element, "joint", name=name, type=kind, axis=axis)


def place_root(data: Any, plan: Plan) -> None:
    """Set the root's planned pose and velocity at time zero; its coordinates are the engine's first."""
    start = np.zeros(1)
    (x, y, z), (vx, vy, vz) = plan.at("hip", start)[0], plan.rate("hip", start)[0]
    attitude, spin = plan.attitude(start)[0], plan.spin_at_start
    if plan.planar:
        data.qpos[:3] = x, z, 2.0 * np.arctan2(attitude[2], attitude[0])
        data.qvel[:3] = vx, vz, spin[1]
        return
    data.qpos[:3], data.qpos[3:7] = (x, y, z), attitude
    data.qvel[:3], data.qvel[3:6] = (vx, vy, vz), spin
