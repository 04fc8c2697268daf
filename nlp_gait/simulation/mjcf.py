"""A robot as MJCF, MuJoCo's model format; needs no MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.formulation.display import Tread
from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Link
from nlp_gait.robots.tree import Body, tree_from
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.looks import FLOOR, add_light, add_world, paint
from nlp_gait.simulation.plan import Plan
from nlp_gait.simulation.root import add_root_joints
from nlp_gait.simulation.shapes import Prism, Shape

# Against 0.1 ms, power is 1 % high in single support; in double support 12 % with set-points held for 40 ms, equal with smooth
# ones. At 1 ms the light feet chatter.
TIME_STEP = 0.0005  # [s]
CONTACT_TIME_CONSTANT = 0.004  # [s]; a hard floor: a fifth of MuJoCo's default
FRICTION = 0.7  # rubber-like soles on a hard floor
TURNING_FRICTION, ROLLING_FRICTION = 0.005, 0.0001  # MuJoCo's defaults; with condim 3 neither acts
LEAST_MOMENT = 1e-12  # of inertia, that MuJoCo takes [kg m^2]
BALL_RADIUS = 1e-3  # [m]
LAST_TREAD, STAIR_HALF_WIDTH = 2.0, 0.25  # [m]

Shapes = Mapping[str, Sequence[Shape]]


def plan_model(plan: Plan, drive: Drive, sole: str = "rectangle", friction: float = FRICTION) -> str:
    """Model of the robot and the ground of a plan; see ``free_model``."""
    return free_model(
        plan.robot, plan.shapes(sole), drive, plan.gravity, friction, ground=plan.ground, planar=plan.planar
    )


def free_model(
    robot: Robot,
    shapes: Shapes,
    drive: Drive,
    gravity: float,
    friction: float = FRICTION,
    *,
    ground: Sequence[Tread] = (),
    planar: bool = False,
) -> str:
    """The whole robot on a floor, driven by position servos; solid shapes can touch the ground, and nothing else.

    Args:
        robot: to be simulated.
        shapes: by link.
        drive: gains and limits of the servos.
        gravity: [m/s^2], along -z.
        friction: coefficient of sliding friction between robot and ground.
        ground: stairs on the floor.
        planar: the robot's root stays in the plane y = 0.
    """
    root, option = document(robot.name, gravity)
    Xml.SubElement(option, "flag", autoreset="disable")  # a simulation that diverges must show it
    Xml.SubElement(
        Xml.SubElement(root, "default"),
        "geom",
        contype="0",
        conaffinity="1",
        condim="3",
        solref=_numbers(CONTACT_TIME_CONSTANT, 1.0),
        friction=_numbers(friction, TURNING_FRICTION, ROLLING_FRICTION),
    )
    _add_hulls(add_world(root), shapes)
    world = Xml.SubElement(root, "worldbody")
    Xml.SubElement(world, "geom", name=FLOOR, type="plane", size="3 3 0.1", contype="1", material=FLOOR)
    _add_stairs(world, ground)
    bodies = add_bodies(world, tree_from(robot, robot.root), shapes, root="planar" if planar else "free")
    paint(bodies, robot)
    add_light(bodies[robot.root])
    for side, foot in robot.feet.items():
        Xml.SubElement(bodies[foot.link], "site", name=side, pos=_numbers(0.0, 0.0, -foot.ankle_height_m), size="0.002")
    actuators = Xml.SubElement(root, "actuator")
    for name, joint in robot.joints.items():
        limit = drive.torque_limit(joint)
        actuator = Xml.SubElement(actuators, "position", name=name, joint=name, forcerange=_numbers(-limit, limit))
        actuator.attrib |= {"kp": _numbers(drive.stiffness(joint)), "kv": _numbers(drive.damping(joint))}
    return text_of(root)


def document(name: str, gravity: float) -> tuple[Xml.Element, Xml.Element]:
    """Root and options of an empty model."""
    root = Xml.Element("mujoco", model=name)
    Xml.SubElement(root, "compiler", angle="radian", autolimits="true")
    option = Xml.SubElement(
        root,
        "option",
        timestep=_numbers(TIME_STEP),
        gravity=_numbers(0.0, 0.0, -gravity),
        integrator="implicitfast",
        cone="elliptic",
    )
    return root, option


def _add_stairs(world: Xml.Element, ground: Sequence[Tread]) -> None:
    """Boxes one on the other's front; the last tread is as long as a stair can be."""
    edges = [tread.edge_m for tread in ground[1:]]
    for i, tread in enumerate(ground):
        end = edges[i] if i < len(edges) else tread.edge_m + LAST_TREAD
        half = ((end - tread.edge_m) / 2, STAIR_HALF_WIDTH, tread.height_m / 2)
        middle = (tread.edge_m + half[0], 0.0, half[2])
        box = Xml.SubElement(world, "geom", name=f"tread {i}", type="box", size=_numbers(*half), pos=_numbers(*middle))
        box.attrib |= {"contype": "1", "rgba": "0.8 0.78 0.74 1"}


def _add_hulls(assets: Xml.Element, shapes: Shapes) -> None:
    """Convex hulls of the soles."""
    for link, parts in shapes.items():
        for i, shape in enumerate(parts):
            if isinstance(shape, Prism):
                levels = (shape.bottom, shape.bottom + shape.thickness)
                corners = [value for z in levels for x, y in shape.outline for value in (x, y, z)]
                Xml.SubElement(assets, "mesh", name=f"{link} {i}", vertex=_numbers(*corners))


def add_bodies(
    world: Xml.Element, tree: Sequence[Body], shapes: Shapes, *, root: Literal["free", "planar", "fixed"]
) -> dict[str, Xml.Element]:
    """Bodies nested as in the tree, each with its frame at its reference point; elements by link."""
    elements: list[Xml.Element] = []
    for body in tree:
        parent = world if body.parent < 0 else elements[body.parent]
        element = Xml.SubElement(parent, "body", name=body.link.name, pos=_numbers(*body.offset_m))
        elements.append(element)
        if body.joint is not None:
            axis = (body.direction * a for a in body.joint.axis)
            limits = _numbers(*body.joint.limits_rad)
            joint = Xml.SubElement(element, "joint", name=body.joint.name, axis=_numbers(*axis), range=limits)
            if body.armature_kgm2:
                joint.set("armature", _numbers(body.armature_kgm2))
        elif root != "fixed":
            add_root_joints(element, planar=root == "planar")
        link = body.link
        tensor, mass = _numbers(*_positive_tensor(link)), _numbers(link.mass_kg)
        Xml.SubElement(element, "inertial", pos=_numbers(*body.com_offset_m), mass=mass, fullinertia=tensor)
        for i, shape in enumerate(shapes.get(link.name, ())):
            _add_geometry(element, shape, f"{link.name} {i}")
    return {body.link.name: element for body, element in zip(tree, elements, strict=True)}


def _positive_tensor(link: Link) -> tuple[float, ...]:
    """Inertia tensor in MJCF's order: xx, yy, zz, xy, xz, yz [kg m^2].

    MuJoCo takes no points and no thin rods: they become as thick as a small ball of their mass.
    """
    moments, products = link.inertia_com_kgm2[:3], link.inertia_com_kgm2[3:]
    thin = np.linalg.eigvalsh(link.inertia_matrix)[0] < LEAST_MOMENT
    ball = 0.4 * link.mass_kg * BALL_RADIUS**2 if thin else 0.0
    return (*(moment + ball for moment in moments), *products)


def _add_geometry(element: Xml.Element, shape: Shape, name: str) -> None:
    if isinstance(shape, Prism):
        Xml.SubElement(element, "geom", name=name, type="mesh", mesh=name)
        return
    if shape.start == shape.end:
        place = {"type": "sphere", "pos": _numbers(*shape.start)}
    else:
        place = {"type": "capsule", "fromto": _numbers(*shape.start, *shape.end)}
    geometry = Xml.SubElement(element, "geom", {"name": name, **place, "size": _numbers(shape.radius)})
    if not shape.solid:
        geometry.set("conaffinity", "0")


def _numbers(*values: float) -> str:
    """Numbers as MJCF reads them, to the last digit."""
    return " ".join(repr(float(value)) for value in values)


def text_of(root: Xml.Element) -> str:
    """A model as MuJoCo reads it."""
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"
