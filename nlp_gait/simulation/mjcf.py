"""Robots and their world in MJCF, MuJoCo's model format; needs no MuJoCo."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.formulation.display import Tread
from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Link
from nlp_gait.robots.tree import TreeBody, make_tree
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import check_range
from nlp_gait.simulation.plan import SIDES, Plan
from nlp_gait.simulation.shapes import Prism, Shape, make_shapes
from nlp_gait.symbolic.dynamics import tilt_gravity

# Compared with 0.1 ms, power is 1 % higher in single support; in double support it is 12 % higher with set-points held for 40 ms
# and equal with smooth ones. At 1 ms the light feet chatter.
TIME_STEP = 0.0005  # [s]
FRICTION = 0.7  # rubber-like soles on a hard floor
TURNING_FRICTION, ROLLING_FRICTION = 0.005, 0.0001  # MuJoCo's defaults; with condim 3 neither acts
LEAST_MOMENT = 1e-12  # of inertia that MuJoCo accepts [kg m^2]
BALL_RADIUS = 1e-3  # [m]
ROUNDING = 1e-9  # by which the sum of two principal moments may miss the third, as a share of it
LAST_TREAD, STAIR_HALF_WIDTH = 2.0, 0.25  # [m]

LEFT, RIGHT, TRUNK = "0.00 0.45 0.70 1", "0.84 0.37 0.00 1", "0.80 0.81 0.84 1"  # blue and orange of Okabe and Ito
SIDE_COLOURS = {"left": LEFT, "right": RIGHT}
# Joints of a root in the sagittal plane, in the order of the engine's coordinates.
PLANAR_JOINTS = {"root x": ("slide", "1 0 0"), "root z": ("slide", "0 0 1"), "root pitch": ("hinge", "0 1 0")}

Shapes = Mapping[str, Sequence[Shape]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bumps:
    """Uneven ground: square tiles of random height along the walk."""

    height_m: float  # heights are uniform from zero to this
    seed: int = 0

    def __post_init__(self) -> None:
        check_range("floor with bumps", "height_m", self.height_m, 1e-6, 1.0)


TILE, TILE_MARGIN = 0.15, 0.5  # side of a tile, and ground around the planned soles that has tiles [height of the hip]


def make_plan_model(
    plan: Plan,
    drive: Drive,
    friction: float = FRICTION,
    bumps: Bumps | None = None,
    sensors: Iterable[Xml.Element] = (),
) -> str:
    """Return the model of a plan's robot with position drives on its ground, which all shapes can touch."""
    robot, shapes = plan.robot, make_plan_shapes(plan)
    root = Xml.fromstring(files("nlp_gait.simulation").joinpath("world.xml").read_text(encoding="utf-8"))
    _, option, default, _, assets, world, actuators = root
    root.set("model", robot.name)
    option.attrib |= {
        "timestep": _format_numbers(TIME_STEP),
        "gravity": _format_numbers(*tilt_gravity(plan.gravity, plan.slope_rad)),
    }
    default[0].set("friction", _format_numbers(friction, TURNING_FRICTION, ROLLING_FRICTION))
    for link, link_shapes in shapes.items():
        for i, shape in enumerate(link_shapes):
            if isinstance(shape, Prism):
                levels = (shape.bottom, shape.bottom + shape.thickness)
                corners = [value for z in levels for x, y in shape.outline for value in (x, y, z)]
                Xml.SubElement(assets, "mesh", name=f"{link} {i}", vertex=_format_numbers(*corners))
    _add_stairs(world, plan.ground)
    if bumps is not None:
        _add_bumps(world, plan, bumps)
    bodies = add_bodies(world, make_tree(robot, robot.root), shapes, root="planar" if plan.planar else "free")
    _paint(bodies, robot)
    light = Xml.SubElement(bodies[robot.root], "light", mode="track", directional="true", pos="0.6 -0.8 1.5")
    light.attrib |= {"dir": "-0.6 0.8 -1.5", "diffuse": "0.5 0.5 0.5", "specular": "0.1 0.1 0.1"}
    for side, foot in robot.feet.items():
        Xml.SubElement(
            bodies[foot.link], "site", name=side, pos=_format_numbers(0.0, 0.0, -foot.ankle_height_m), size="0.002"
        )
    for side, toe in robot.toes.items():
        Xml.SubElement(
            bodies[toe.link], "site", name=f"{side} tip", pos=_format_numbers(toe.front_m, 0.0, 0.0), size="0.002"
        )
    for name, joint in robot.joints.items():
        limit = drive.torque_limit(joint)
        actuator = Xml.SubElement(
            actuators, "position", name=name, joint=name, forcerange=_format_numbers(-limit, limit)
        )
        actuator.attrib |= {"kp": _format_numbers(drive.stiffness(joint)), "kv": _format_numbers(drive.damping(joint))}
    if elements := list(sensors):
        Xml.SubElement(root, "sensor").extend(elements)
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"


def make_plan_shapes(plan: Plan) -> dict[str, list[Shape]]:
    """Return the shapes of a plan's robot by link; those of welded joints are parts of the parents."""
    welded = [joint for joint in plan.full_robot.joints if joint not in plan.robot.joints]
    return make_shapes(plan.full_robot, welded)


def _add_bumps(world: Xml.Element, plan: Plan, bumps: Bumps) -> None:
    """Add tiles under the whole walk, except where the feet stand at its begin."""
    samples, random = plan.signals.arrays, np.random.default_rng(bumps.seed)
    hip = float(samples["hip"][0, 2])
    feet = np.concatenate([samples[f"{side}_foot"][:, :2] for side in SIDES])
    start = np.array([samples[f"{side}_foot"][0, :2] for side in SIDES])
    size, margin = TILE * hip, TILE_MARGIN * hip
    low, high = feet.min(axis=0) - margin, feet.max(axis=0) + margin
    edges = np.array([tread.edge_m for tread in plan.ground])
    for i, x in enumerate(np.arange(low[0], high[0], size)):
        back, front = x - size / 2, x + size / 2  # no tile is on two treads
        back = max([back, *edges[edges <= x]])
        front = min([front, *edges[edges > x]])
        for j, y in enumerate(np.arange(low[1], high[1], size)):
            top = float(random.uniform(0.0, bumps.height_m))
            if np.abs(start - (x, y)).max(axis=1).min() < margin / 2 + size:
                continue
            place = (back + front) / 2, y, float(plan.level(np.array([x]))[0]) + top - size / 2
            half = (front - back) / 2, size / 2, size / 2
            box = {"name": f"bump {i} {j}", "type": "box", "contype": "1", "material": "floor"}
            Xml.SubElement(world, "geom", box, pos=_format_numbers(*place), size=_format_numbers(*half))


def _add_stairs(world: Xml.Element, ground: Sequence[Tread]) -> None:
    """Add a box for each tread up to the next one; the last one has a fixed length."""
    edges = [tread.edge_m for tread in ground[1:]]
    for i, tread in enumerate(ground):
        end = edges[i] if i < len(edges) else tread.edge_m + LAST_TREAD
        half = ((end - tread.edge_m) / 2, STAIR_HALF_WIDTH, tread.height_m / 2)
        middle = (tread.edge_m + half[0], 0.0, half[2])
        box = Xml.SubElement(
            world, "geom", name=f"tread {i}", type="box", size=_format_numbers(*half), pos=_format_numbers(*middle)
        )
        box.attrib |= {"contype": "1", "rgba": "0.8 0.78 0.74 1"}


def add_bodies(
    world: Xml.Element, tree: Sequence[TreeBody], shapes: Shapes, *, root: Literal["free", "planar", "fixed"]
) -> dict[str, Xml.Element]:
    """Add the bodies of a tree, each with its frame at its reference point; return the elements by link."""
    elements: list[Xml.Element] = []
    for body in tree:
        parent = world if body.parent < 0 else elements[body.parent]
        element = Xml.SubElement(parent, "body", name=body.link.name, pos=_format_numbers(*body.offset_m))
        elements.append(element)
        if body.joint is not None:
            axis = (body.direction * a for a in body.joint.axis)
            limits = _format_numbers(*body.joint.limits_rad)
            joint = Xml.SubElement(element, "joint", name=body.joint.name, axis=_format_numbers(*axis), range=limits)
            joint.attrib |= {
                name: _format_numbers(value)
                for name, value in (
                    ("armature", body.joint.armature_kgm2),
                    ("damping", body.joint.damping_Nms_rad),
                    ("frictionloss", body.joint.friction_Nm),
                )
                if value
            }
        elif root == "free":
            Xml.SubElement(element, "freejoint")
        elif root == "planar":
            for name, (kind, along) in PLANAR_JOINTS.items():
                Xml.SubElement(element, "joint", name=name, type=kind, axis=along)
        link = body.link
        tensor, mass = _format_numbers(*_make_positive_tensor(link)), _format_numbers(link.mass_kg)
        Xml.SubElement(element, "inertial", pos=_format_numbers(*body.com_offset_m), mass=mass, fullinertia=tensor)
        for i, shape in enumerate(shapes.get(link.name, ())):
            _add_geometry(element, shape, f"{link.name} {i}")
    return {body.link.name: element for body, element in zip(tree, elements, strict=True)}


def _make_positive_tensor(link: Link) -> tuple[float, ...]:
    """Return the tensor xx, yy, zz, xy, xz, yz [kg m^2]; points, rods and plates, which MuJoCo refuses, get a small ball's."""
    moments, products = link.inertia_com_kgm2[:3], link.inertia_com_kgm2[3:]
    low, middle, high = np.linalg.eigvalsh(link.inertia_matrix)
    excess, ball = high - low - middle, 0.0
    if low < LEAST_MOMENT or excess > -ROUNDING * high:
        ball = max(0.4 * link.mass_kg * BALL_RADIUS**2, 2.0 * excess)
    return (*(moment + ball for moment in moments), *products)


def _add_geometry(element: Xml.Element, shape: Shape, name: str) -> None:
    if isinstance(shape, Prism):
        Xml.SubElement(element, "geom", name=name, type="mesh", mesh=name)
        return
    if shape.start == shape.end:
        place = {"type": "sphere", "pos": _format_numbers(*shape.start)}
    else:
        place = {"type": "capsule", "fromto": _format_numbers(*shape.start, *shape.end)}
    Xml.SubElement(element, "geom", {"name": name, **place, "size": _format_numbers(shape.radius)})


def _format_numbers(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _paint(bodies: Mapping[str, Xml.Element], robot: Robot) -> None:
    """Colour the shapes of the legs by their side, all others grey."""
    sides = find_sides(robot)
    for link, body in bodies.items():
        for geom in body.findall("geom"):
            geom.set("rgba", SIDE_COLOURS[sides[link]] if link in sides else TRUNK)


def find_sides(robot: Robot) -> dict[str, str]:
    """Return the side of each link of a leg, between the root and a foot or beyond the foot."""
    above = {link: {link, *(joint.child for joint in robot.path_to_root(link))} for link in robot.links}
    sides = {}
    for link in robot.links:
        matching = [side for side, foot in robot.feet.items() if link in above[foot.link] or foot.link in above[link]]
        if len(matching) == 1:
            sides[link] = matching[0]
    return sides
