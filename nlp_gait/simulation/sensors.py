"""What is measured at every step of the engine: sensors in MJCF, and their values as arrays."""

from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import LEAST_LOAD
from nlp_gait.simulation.plan import SIDES, Plan

MOST_CONTACTS, MOST_OF_FOOT = 128, 64  # points of contact that are measured, of the robot and of a foot's link
CONTACT_VALUES = 10  # of a point: whether it is one, its force in its own axes, place, and normal
HEIGHT, UPWARD = 8, slice(12, 15)  # columns of the torso's height and of its upward axis
STEEP = 0.7  # vertical part of a contact's normal, below which it is with a riser


class Readings(NamedTuple):
    """Values of all sensors at T instants."""

    feet: Array  # (T, 2, 3) soles under the ankles [m]
    torso: Array  # (T, 3) its origin [m]
    forward: Array  # (T, 3) its axis
    torque: Array  # (T, J) of the drives [Nm]
    loads: Array  # (T, 2) normal forces on both feet, from all contacts with the ground [N]
    risers: Array  # (T, 2) of these, normal forces of steep faces [N]
    pressure: Array  # (T, 2) centre of pressure of all contacts [m]; NaN in flight


def list_sensors(plan: Plan) -> Iterator[Xml.Element]:
    """Yield the sensors of a plan's robot, whose values ``read_sensors`` takes."""
    for side in SIDES:
        yield Xml.Element("framepos", objtype="site", objname=side)
    for kind in ("framepos", "framexaxis", "framezaxis"):
        yield Xml.Element(kind, objtype="xbody", objname=plan.robot.root)
    for name in plan.joints:
        yield Xml.Element("actuatorfrc", actuator=name)
    yield Xml.Element("contact", num=str(MOST_CONTACTS), data="found force pos normal")
    for _, link in _list_feet(plan):
        yield Xml.Element("contact", body1=link, num=str(MOST_OF_FOOT), data="found force pos normal")


def read_sensors(plan: Plan, values: Any) -> Readings:
    """Return the values (T, S) of all sensors by quantity; raises InputError where more contacts touch than are measured."""
    count, joints, feet = len(values), len(plan.joints), list(_list_feet(plan))
    sizes = (6, 3, 3, 3, joints, MOST_CONTACTS * CONTACT_VALUES, *[MOST_OF_FOOT * CONTACT_VALUES] * len(feet))
    soles, torso, forward, _, torque, *contacts = np.split(values, np.cumsum(sizes)[:-1], axis=1)
    contacts = [touching.reshape(count, -1, CONTACT_VALUES) for touching in contacts]
    if any((touching[:, 0, 0] > touching.shape[1]).any() for touching in contacts):
        raise InputError(f"the robot touches the ground at more than {MOST_CONTACTS} points; use larger or fewer bumps")
    loads, risers = np.zeros((count, 2)), np.zeros((count, 2))
    for (side, _), touching in zip(feet, contacts[1:], strict=True):
        forces = touching[:, :, 1]
        loads[:, side] += forces.sum(axis=1)
        risers[:, side] += (forces * (np.abs(touching[:, :, 9]) < STEEP)).sum(axis=1)
    forces, places = contacts[0][:, :, 1], contacts[0][:, :, 4:6]
    total = forces.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = np.einsum("tc,tcx->tx", forces, places) / total
    pressure = np.where(total > LEAST_LOAD, centre, np.nan)
    return Readings(soles.reshape(count, 2, 3), torso, forward, torque, loads, risers, pressure)


def _list_feet(plan: Plan) -> Iterator[tuple[int, str]]:
    """Yield the number in ``SIDES`` and the link of each foot and toe."""
    for side, name in enumerate(SIDES):
        for contacts in (plan.robot.feet, plan.robot.toes):
            if name in contacts:
                yield side, contacts[name].link
