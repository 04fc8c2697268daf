"""How a simulated robot and its world look; nothing here changes how they move."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from xml.etree import ElementTree as Xml

from nlp_gait.robots import Robot

FLOOR = "floor"  # its name, and that of its material
LEFT, RIGHT, TRUNK = "0.00 0.45 0.70 1", "0.84 0.37 0.00 1", "0.80 0.81 0.84 1"  # blue and orange of Okabe and Ito
SIDE_COLOURS: Mapping[str, str] = MappingProxyType({"left": LEFT, "right": RIGHT})
LIMBS = "1"  # group of the geometries that a view from above leaves out; soles and floor are in group 0
LINES_PER_M = 10  # of the floor's grid


def paint(bodies: Mapping[str, Xml.Element], robot: Robot) -> None:
    """Give every shape its colour: the legs' by their side, all else grey."""
    above = {link: {link, *(joint.child for joint in robot.path_to_root(link))} for link in bodies}
    feet = {side: foot.link for side, foot in robot.feet.items()}
    for link, body in bodies.items():
        # A leg is what lies between the root and a foot, and beyond the foot.
        sides = [side for side, foot in feet.items() if link in above[foot] or foot in above[link]]
        for geom in body.findall("geom"):
            geom.set("rgba", SIDE_COLOURS[sides[0]] if len(sides) == 1 else TRUNK)
            if geom.get("type") != "mesh":
                geom.set("group", LIMBS)


def add_world(root: Xml.Element) -> Xml.Element:
    """Light, sky and the floor's material, a grid with a line every 10 cm; returns the element of assets."""
    visual = Xml.SubElement(root, "visual")
    Xml.SubElement(visual, "global", fovy="30")
    Xml.SubElement(visual, "headlight", ambient="0.42 0.42 0.42", diffuse="0.3 0.3 0.3", specular="0 0 0")
    Xml.SubElement(visual, "quality", shadowsize="4096")
    Xml.SubElement(visual, "map", shadowclip="2")
    assets = Xml.SubElement(root, "asset")
    sky = Xml.SubElement(assets, "texture", type="skybox", builtin="gradient", width="64", height="384")
    sky.attrib |= {"rgb1": "1 1 1", "rgb2": "0.80 0.87 0.93"}
    tiles = Xml.SubElement(assets, "texture", name=FLOOR, type="2d", builtin="checker", mark="edge")
    tiles.attrib |= {"width": "128", "height": "128"}
    tiles.attrib |= {"rgb1": "0.93 0.94 0.95", "rgb2": "0.87 0.89 0.91", "markrgb": "0.55 0.58 0.62"}
    # One texture shows two cells in each direction.
    repeat = f"{LINES_PER_M / 2:g} {LINES_PER_M / 2:g}"
    Xml.SubElement(assets, "material", name=FLOOR, texture=FLOOR, texuniform="true", texrepeat=repeat)
    return assets


def add_light(torso: Xml.Element) -> None:
    """A light that goes with the robot and casts its shadow."""
    light = Xml.SubElement(torso, "light", mode="track", directional="true", pos="0.6 -0.8 1.5", dir="-0.6 0.8 -1.5")
    light.attrib |= {"diffuse": "0.5 0.5 0.5", "specular": "0.1 0.1 0.1"}
