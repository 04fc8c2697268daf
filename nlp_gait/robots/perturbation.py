"""Robots with other masses, leg lengths or soles: for sensitivities, worst cases, and what-if questions.

Changes are written after a robot's name, ``nao-v5@mass=1.05,thigh_m=0.001``, wherever the name can be used:

    mass            factor on the masses and inertias of all links
    LINK.mass       the same for one link, for example ``LThigh.mass``
    thigh_m         added between the knees and the joints above; masses, centres of mass and inertias stay
    tibia_m         added between the upper ankle joints and the knees
    sole_x_m        both soles shifted forwards under their ankles
    sole_y_m        both soles shifted to the left
    sole_front_m    added to both soles' extent forwards; also ``sole_back_m``, ``sole_left_m``, ``sole_right_m``
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from nlp_gait.errors import InputError, unknown
from nlp_gait.robots.packages import MODEL_ENDINGS
from nlp_gait.robots.robot import Robot

MARK = "@"
MASS = "mass"
# Change of each extent of a sole per unit of a quantity.
SOLES: Mapping[str, Mapping[str, int]] = {
    "sole_x_m": {"front_m": 1, "back_m": -1},
    "sole_y_m": {"left_m": 1, "right_m": -1},
    **{f"sole_{extent}": {extent: 1} for extent in ("front_m", "back_m", "left_m", "right_m")},
}
# Index of the joint at the lower end of a part of the leg, from the foot upwards: two of the ankle, then the knee.
LENGTHS = {"thigh_m": 2, "tibia_m": 1}


def perturb(robot: Robot, changes: Mapping[str, float]) -> Robot:
    """Return the robot with some quantities changed, in the given order: factors of masses, and lengths to add [m].

    Raises UnknownNameError, RobotDataError if the result is physically impossible, or InputError for an infinite value.
    """
    for name, value in changes.items():
        if not math.isfinite(value):
            raise InputError(f"robot {robot.name!r}: {name} must be a finite number, got {value}")
        robot = _change(robot, name, value)
    return replace(robot, name=name_perturbed(robot.name, changes)) if changes else robot


def name_perturbed(name: str, changes: Mapping[str, float]) -> str:
    """Return a robot's name with its changes as text, to the last digit."""
    return f"{name}{MARK}{','.join(f'{key}={value!r}' for key, value in changes.items())}" if changes else name


def split_name(text: str) -> tuple[str, dict[str, float]]:
    """Split a robot's name and its changes; raises InputError if the text after the mark is not a list of changes."""
    name, mark, listed = text.rpartition(MARK)
    if not mark or listed.lower().endswith((".json", *MODEL_ENDINGS)):  # the mark may be part of a file's path
        return text, {}
    changes: dict[str, float] = {}
    for item in listed.split(","):
        key, equals, value = item.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise InputError(
                f"robot {text!r}: after {MARK}, expected NAME=NUMBER, separated by commas, got {item!r}; for example "
                f"nao-v5{MARK}mass=1.05,thigh_m=0.001"
            ) from None
        if key.strip() in changes:
            raise InputError(f"robot {text!r}: {key.strip()} is duplicated after {MARK}; give it once")
        changes[key.strip()] = number
    return name, changes


def list_quantities(robot: Robot) -> tuple[str, ...]:
    """Return the names of all quantities that can be changed in a robot."""
    return (MASS, *(f"{link}.{MASS}" for link in robot.links), *LENGTHS, *SOLES)


def _change(robot: Robot, name: str, value: float) -> Robot:
    if name in LENGTHS:
        return _with_length(robot, LENGTHS[name], value)
    if name in SOLES:
        feet = {
            side: replace(foot, **{key: getattr(foot, key) + share * value for key, share in SOLES[name].items()})
            for side, foot in robot.feet.items()
        }
        return replace(robot, feet=feet)
    changed = [link for link in robot.links if name in (MASS, f"{link}.{MASS}")]
    if not changed:
        raise unknown(f"quantity of robot {robot.name}", name, list_quantities(robot))
    links = dict(robot.links)
    for link in changed:
        ixx, iyy, izz, ixy, ixz, iyz = (value * moment for moment in links[link].inertia_com_kgm2)
        moments = ixx, iyy, izz, ixy, ixz, iyz
        links[link] = replace(links[link], mass_kg=value * links[link].mass_kg, inertia_com_kgm2=moments)
    return replace(robot, links=links)


def _with_length(robot: Robot, above_foot: int, metres: float) -> Robot:
    joints = dict(robot.joints)
    for side, foot in robot.feet.items():
        path = robot.path_to_root(foot.link)
        if len(path) <= above_foot + 1:
            raise InputError(
                f"robot {robot.name!r}: the {side} leg has {len(path)} joints, too few for a thigh and a shank whose length "
                "can change"
            )
        name = path[above_foot].name
        origin = joints[name].origin_m
        length = math.hypot(*origin)
        if not (length > 0.0 and length + metres > 0.0):
            raise InputError(
                f"robot {robot.name!r}: joint {name!r} is {length:g} m below the one above it; adding {metres:g} m "
                "leaves no length"
            )
        x, y, z = (value * (1.0 + metres / length) for value in origin)
        joints[name] = replace(joints[name], origin_m=(x, y, z))
    return replace(robot, joints=joints)
