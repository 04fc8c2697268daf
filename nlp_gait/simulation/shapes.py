"""Primitive shapes of a robot's links, for drawing and for contacts with the floor."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np

from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Vector
from nlp_gait.robots.tree import to_vector

SOLE_THICKNESS = 0.015  # [m]; the sole's lower face alone touches the floor
LIMB_RADIUS = 0.02  # [m]
TRUNK_RADIUS = 0.045  # [m]
SHORTEST_LIMB = 0.02  # [m]; joints closer together than this share a centre


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule:
    """Cylinder with round ends [m], or a ball if both ends are equal."""

    start: Vector
    end: Vector
    radius: float

    def move(self, by: Vector) -> Self:
        """Return the shape, moved by a vector."""
        return replace(self, start=to_vector(np.add(self.start, by)), end=to_vector(np.add(self.end, by)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Prism:
    """Convex outline (x, y) with a thickness upwards from ``bottom`` [m]."""

    outline: tuple[tuple[float, float], ...]
    bottom: float
    thickness: float

    def move(self, by: Vector) -> Self:
        """Return the shape, moved by a vector."""
        outline = tuple((x + by[0], y + by[1]) for x, y in self.outline)
        return replace(self, outline=outline, bottom=self.bottom + by[2])


Shape: TypeAlias = Capsule | Prism


def make_shapes(robot: Robot, welded: Collection[str] = ()) -> dict[str, list[Shape]]:
    """Return capsules, a ball for a head and prisms for soles by link, in link axes; welded joints' move to the parents.

    A limb that ends near the ground is shorter by twice its radius, so that the sole touches first.
    """
    shapes: dict[str, list[Shape]] = {name: [] for name in robot.links}
    low = _find_low_joints(robot)
    for joint in robot.joints.values():
        radius = TRUNK_RADIUS if joint.parent == robot.root else LIMB_RADIUS
        if np.linalg.norm(joint.origin_m) >= SHORTEST_LIMB and joint.parent not in robot.soles:
            length = float(np.linalg.norm(joint.origin_m))
            share = max(1.0 - 2.0 * radius / length, 0.0) if joint.name in low else 1.0
            x, y, z = joint.origin_m
            end = (share * x, share * y, share * z)
            shapes[joint.parent].append(Capsule(start=(0.0, 0.0, 0.0), end=end, radius=radius))
    parents = {joint.parent for joint in robot.joints.values()}
    for name, link in robot.links.items():
        if name in robot.soles:
            foot = robot.soles[name]
            front, back, left, right = foot.front_m, -foot.back_m, foot.left_m, -foot.right_m
            outline = ((front, left), (back, left), (back, right), (front, right))
            shapes[name].append(Prism(outline=outline, bottom=-foot.ankle_height_m, thickness=SOLE_THICKNESS))
        elif name == robot.root and not shapes[name]:  # all limbs start at one point of the trunk: a rod from there
            x, y, z = link.com_m
            shapes[name].append(Capsule(start=(0.0, 0.0, 0.0), end=(2 * x, 2 * y, 2 * z), radius=TRUNK_RADIUS))
        elif name not in parents:  # a hand or a head, about its centre of mass
            radius = TRUNK_RADIUS if np.linalg.norm(link.com_m) > SHORTEST_LIMB + LIMB_RADIUS else LIMB_RADIUS
            shapes[name].append(Capsule(start=link.com_m, end=link.com_m, radius=radius))
    for joint in sorted((robot.joint(name) for name in welded), key=lambda j: -len(robot.path_to_root(j.child))):
        shapes[joint.parent] += [shape.move(joint.origin_m) for shape in shapes.pop(joint.child)]
    return shapes


def _find_low_joints(robot: Robot) -> set[str]:
    """Return the joints so close to the ground that a limb's round end would touch it instead of the sole."""
    low = set()
    for foot in robot.feet.values():
        for joint in robot.path_to_root(foot.link):
            if foot.ankle_height_m >= LIMB_RADIUS:
                break
            low.add(joint.name)
            if np.linalg.norm(joint.origin_m) >= SHORTEST_LIMB:
                break
    return low
