"""Robot files of a user: a humanoid that is not NAO, as JSON and as URDF."""

import copy
import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlp_gait.formulation import Array
from nlp_gait.robots import Robot

Record = dict[str, Any]

THIGH, TIBIA, HIP_OFFSET, HEAVIER = 0.12, 0.11, 0.06, 1.2


def written(folder: Path, raw: object) -> str:
    """Path of a robot file with this content: text as it is, anything else as JSON."""
    path = folder / "robot.json"
    path.write_text(raw if isinstance(raw, str) else json.dumps(raw), encoding="utf-8")
    return str(path)


def assert_same(one: Robot, other: Robot, tolerance: float = 1e-12) -> None:
    """Compare links and joints; by default to the rounding of rotations on lengths below 1 m and masses of about 1 kg."""
    assert (one.root, set(one.links), set(one.joints)) == (other.root, set(other.links), set(other.joints))
    for name, link in one.links.items():
        assert link.mass_kg == pytest.approx(other.links[name].mass_kg, rel=tolerance)
        for field in ("com_m", "inertia_matrix"):
            expected = getattr(other.links[name], field)
            np.testing.assert_allclose(getattr(link, field), expected, rtol=0, atol=tolerance, err_msg=name)
    for name, joint in one.joints.items():
        twin = other.joints[name]
        assert (joint.parent, joint.child, joint.torque_limit_Nm) == (twin.parent, twin.child, twin.torque_limit_Nm)
        for field in ("limits_rad", "origin_m", "axis"):
            np.testing.assert_allclose(
                getattr(joint, field), getattr(twin, field), rtol=0, atol=tolerance, err_msg=name
            )


def nao() -> Record:
    """The file of NAO V5."""
    text = (resources.files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8")
    record: Record = json.loads(text)
    return record


def humanoid() -> Record:
    """A heavier robot with longer thighs, wider hips and a larger foot; segments grow in length as their joints do."""
    raw = copy.deepcopy(nao())
    raw["name"] = "humanoid"
    for side, sign in (("L", 1), ("R", -1)):
        raw["joints"][f"{side}HipYawPitch"]["origin_m"][1] = sign * HIP_OFFSET
        for joint, link, length in (("KneePitch", "Thigh", THIGH), ("AnklePitch", "Tibia", TIBIA)):
            origin = raw["joints"][f"{side}{joint}"]["origin_m"]
            longer = length / -origin[2]
            origin[2] = -length
            stretch(raw["links"][f"{side}{link}"], longer)
    for link in raw["links"].values():
        link["mass_kg"] *= HEAVIER
        link["inertia_com_kgm2"] = [HEAVIER * moment for moment in link["inertia_com_kgm2"]]
    for foot in raw["feet"].values():
        foot |= {"front_m": 0.11, "left_m": 0.045, "right_m": 0.045}
    for joint in raw["joints"].values():
        joint.pop("planning_limits_rad", None)
    return raw


def stretch(link: Record, factor: float) -> None:
    """Make a link longer along z."""
    link["com_m"][2] *= factor
    ixx, iyy, izz, ixy, ixz, iyz = link["inertia_com_kgm2"]
    along = (ixx + iyy - izz) / 2  # second moment along z
    grown = (factor**2 - 1) * along
    link["inertia_com_kgm2"] = [ixx + grown, iyy + grown, izz, ixy, factor * ixz, factor * iyz]


def about_joints(raw: Record) -> Record:
    """The robot with every tensor taken about the joint, in the field for the centre of mass."""
    wrong = copy.deepcopy(raw)
    for link in wrong["links"].values():
        link["inertia_com_kgm2"] = six(
            matrix(link["inertia_com_kgm2"]) + of_point(link["mass_kg"], np.array(link["com_m"]))
        )
    return wrong


def as_urdf(raw: Record, turned: Mapping[str, Rotation] | None = None) -> ElementTree.Element:
    """URDF of a robot; the frames of the links in ``turned`` have other axes at the zero pose than the root's."""
    turned = turned or {}
    turns = {name: turned.get(name, Rotation.identity()) for name in raw["links"]}
    robot = ElementTree.Element("robot", name=raw["name"])
    for name, link in raw["links"].items():
        inertial = ElementTree.SubElement(ElementTree.SubElement(robot, "link", name=name), "inertial")
        ElementTree.SubElement(inertial, "mass", value=repr(link["mass_kg"]))
        to_link = turns[name].inv()
        ElementTree.SubElement(inertial, "origin", xyz=words(to_link.apply(link["com_m"])))
        tensor = to_link.as_matrix() @ matrix(link["inertia_com_kgm2"]) @ to_link.as_matrix().T
        moments = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), six(tensor), strict=True)
        ElementTree.SubElement(inertial, "inertia", {key: repr(moment) for key, moment in moments})
    for name, joint in raw["joints"].items():
        add_joint(robot, name, joint, turns)
    return robot


def add_joint(robot: ElementTree.Element, name: str, joint: Record, turns: Mapping[str, Rotation]) -> None:
    element = ElementTree.SubElement(robot, "joint", name=name, type="revolute")
    to_parent, child = turns[joint["parent"]].inv(), turns[joint["child"]]
    relative = (to_parent * child).as_euler("xyz")
    ElementTree.SubElement(element, "origin", xyz=words(to_parent.apply(joint["origin_m"])), rpy=words(relative))
    ElementTree.SubElement(element, "parent", link=joint["parent"])
    ElementTree.SubElement(element, "child", link=joint["child"])
    ElementTree.SubElement(element, "axis", xyz=words(child.inv().apply(joint["axis"])))
    low, high = joint["limits_rad"]
    effort, velocity = joint["torque_limit_Nm"], joint["velocity_limit_rad_s"]
    limit = {"lower": low, "upper": high, "effort": effort, "velocity": velocity}
    ElementTree.SubElement(element, "limit", {key: repr(value) for key, value in limit.items()})


def partner(raw: Record, urdf: str, **more: object) -> Record:
    """The robot file that gives a URDF its soles."""
    return {"schema": 1, "extends": urdf, "feet": raw["feet"], **more}


def words(vector: Array) -> str:
    return " ".join(repr(float(component)) for component in vector)


def matrix(moments: list[float]) -> Array:
    ixx, iyy, izz, ixy, ixz, iyz = moments
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def six(tensor: Array) -> list[float]:
    return [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def of_point(mass: float, offset: Array) -> Array:
    return np.asarray(mass * (offset @ offset * np.eye(3) - np.outer(offset, offset)))
