"""What is measured at every step of the engine: sensors in MJCF, and their values as arrays."""

from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import LEAST_LOAD
from nlp_gait.simulation.plan import SIDES, Plan

MOST_ON_FLOOR, MOST_ON_OBSTACLES = 16, 64  # points of contact of a foot's link that are measured
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
    pressure: Array  # (T, 2) centre of pressure of both feet [m]; NaN in flight


def list_sensors(plan: Plan, bumps: bool) -> Iterator[Xml.Element]:
    """Yield the sensors of a plan's robot, on a floor with bumps or without, whose values ``read_sensors`` takes."""
    most = MOST_ON_OBSTACLES if bumps or plan.ground else MOST_ON_FLOOR
    for side in SIDES:
        yield Xml.Element("framepos", objtype="site", objname=side)
    for kind in ("framepos", "framexaxis", "framezaxis"):
        yield Xml.Element(kind, objtype="xbody", objname=plan.robot.root)
    for name in plan.joints:
        yield Xml.Element("actuatorfrc", actuator=name)
    for _, link in _list_feet(plan):
        yield Xml.Element("contact", body1=link, num=str(most), data="found force pos normal")


def read_sensors(plan: Plan, values: Any) -> Readings:
    """Return the values (T, S) of all sensors by quantity; raises InputError where more contacts touch than are measured."""
    count, feet = len(values), [side for side, _ in _list_feet(plan)]
    soles, torso, forward, _, torque, found = np.split(values, np.cumsum([6, 3, 3, 3, len(plan.joints)]), axis=1)
    contacts = found.reshape(count, len(feet), -1, CONTACT_VALUES)
    if (contacts[:, :, 0, 0] > (most := contacts.shape[2])).any():
        raise InputError(f"a foot touches the ground at more than {most} points; use larger or fewer bumps")
    forces, places = contacts[..., 1], contacts[..., 4:6]
    steep = forces * (np.abs(contacts[..., 9]) < STEEP)
    loads, risers = np.zeros((count, 2)), np.zeros((count, 2))
    for i, side in enumerate(feet):
        loads[:, side] += forces[:, i].sum(axis=1)
        risers[:, side] += steep[:, i].sum(axis=1)
    total = loads.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        centre = np.einsum("tfc,tfcx->tx", forces, places) / total
    pressure = np.where(total > LEAST_LOAD, centre, np.nan)
    return Readings(soles.reshape(count, 2, 3), torso, forward, torque, loads, risers, pressure)


def _list_feet(plan: Plan) -> Iterator[tuple[int, str]]:
    """Yield the number in ``SIDES`` and the link of each foot and toe."""
    for side, name in enumerate(SIDES):
        for contacts in (plan.robot.feet, plan.robot.toes):
            if name in contacts:
                yield side, contacts[name].link
