"""Single and double support of Gupta, Pratihar, Deb (2023) for many x at once.

No algorithm of rigid-body dynamics is used: where every link is, is a Taylor series in time; its momentum follows from the
series' derivatives; and the torque of a joint is the moment that the rate of the momentum of all that it carries asks for.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from typing import Any

import numpy as np

from tests.referee.series import Array, Series, atan2, cubic, sincos, sqrt, stack, time

GRAVITY = 9.8  # text after eq. (26)
HEAT = 0.025  # K of eq. (32)
THIGH, TIBIA = 0.100, 0.1029  # Table 1
HIP_Y, HIP_Z, ANKLE = 0.050, 0.085, 0.04519  # Table 1
FRONT, BACK, SIDE = 0.10, 0.05, 0.04  # eqs. (21), (22)
STANCE, LANDED = (0.06, 0.05), (0.12, -0.05)  # feet in double support; the first is the support of single support
LEG = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
JOINTS = tuple(f"{side}{name}" for part in (LEG, ARM) for side in "LR" for name in part)
TRUNK = ("torso", "Neck", "Head")


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What the paper's text leaves open."""

    samples: int = 11  # ten equal parts (section 4.1), or ten samples
    as_printed: bool = False  # (19), (20) with z'' - g and without a term I omega
    lumped: bool = (
        False  # neck and head of double support at the torso's centre of mass in the ZMP: 23 masses (section 3.2)
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """A link's motion."""

    joint: str  #: that carries it; empty for the torso
    place: Array  #: (3, N) series of the joint [m]
    axis: Array  #: (3, N) of the joint in the world
    force: Array  #: (3, N) rate of its momentum with the weight that is to be carried, m (a + g) [N]
    moment: Array  #: (3, N) rate of its angular momentum about its own centre of mass [Nm]
    centre: Array  #: (3, N) centre of mass [m]
    mass: Array | float  #: of the link [kg], or of a share of it
    acceleration: Array  #: (3, N) of the centre of mass [m/s^2]


def robot() -> Mapping[str, Any]:
    """Public tables of NAO V5: masses, centres, inertias, joints."""
    text = (resources.files("nlp_gait.robots") / "data" / "nao-v5.json").read_text(encoding="utf-8")
    data: Mapping[str, Any] = json.loads(text)
    return data


def single_support(X: Array, robot: Mapping[str, Any], reading: Reading = Reading()) -> dict[str, Array]:
    """Objective, rows and metrics by name, each (P,), at X (P, 9)."""
    x1, x2, x3, x4, x5, x6, x7, x8, x9 = X.T[:, None, :]
    T = np.broadcast_to(x9, (reading.samples, len(X)))
    t = time(np.linspace(0.0, 1.0, reading.samples)[:, None] * x9, 2)
    along, across, up = ((0.03, 0.09), (x4, x5)), ((0.025, 0.025), (x6, x7)), ((x1, x1), (x2, x3))
    hip = stack([cubic(t, T, *ends) for ends in (along, across, up)])  # Table 3, rows 3 to 5
    along = cubic(t, T, (0.0, 0.12), (0.0, 0.0))  # row 1
    away = (along - 0.06) / 0.06
    swing = stack([along, -0.05, x8 * (1.0 - away * away)])  # row 2
    arms = {"L": ((2.0, 1.0), (-0.42, -0.64)), "R": ((1.0, 2.0), (0.64, 0.42))}  # rows 6 to 9
    angles, reach = _posture(t, T, hip, {"L": t.like(0.0) + _column(STANCE), "R": swing}, arms)
    links = _links(robot, hip, angles)
    torque = _torques(links, {"L": None}, robot)
    zmp, _ = _zmp(links.values(), reading)
    margins = (_margin(zmp[0], STANCE[0], FRONT, BACK), _margin(zmp[1], STANCE[1], SIDE, SIDE))
    return _collected(torque, angles, reach, margins, T)


def double_support(X: Array, robot: Mapping[str, Any], reading: Reading = Reading()) -> dict[str, Array]:
    """The same at X (P, 8)."""
    x1, x2, x3, x4, x5, x6, x7, x8 = X.T[:, None, :]
    T = np.broadcast_to(x8, (reading.samples, len(X)))
    t = time(np.linspace(0.0, 1.0, reading.samples)[:, None] * x8, 2)
    along, across, up = ((0.07, 0.11), (x4, x5)), ((0.025, -0.025), (x6, x7)), ((x1, x1), (x2, x3))
    hip = stack([cubic(t, T, *ends) for ends in (along, across, up)])  # Table 5
    arms = {"L": ((1.0, 1.5), (-0.64, -0.50)), "R": ((2.0, 1.5), (0.42, 0.50))}
    feet = {side: t.like(0.0) + _column(foot) for side, foot in (("L", STANCE), ("R", LANDED))}
    angles, reach = _posture(t, T, hip, feet, arms)
    links = _links(robot, hip, angles)
    y = hip.d(0)[1]
    from_left, from_right = STANCE[1] - y, y - LANDED[1]
    shares = {"L": from_left / (from_left + from_right), "R": from_right / (from_left + from_right)}  # (28), (29)
    torque = _torques(links, shares, robot)
    placed = dict(links)
    if reading.lumped:
        torso = links["torso"]
        placed |= {name: replace(links[name], centre=torso.centre, acceleration=torso.acceleration) for name in TRUNK}
    points, loads = zip(*(_zmp(_half(placed, side, share), reading) for side, share in shares.items()), strict=True)
    zmp = (points[0] * loads[0] + points[1] * loads[1]) / (loads[0] + loads[1])  # (30), (31)
    box = (STANCE[0] - BACK, LANDED[0] + FRONT), (LANDED[1] - SIDE, STANCE[1] + SIDE)
    margins = tuple(np.minimum(zmp[k] - low, high - zmp[k]) for k, (low, high) in enumerate(box))
    return _collected(torque, angles, reach, margins, T)


def _column(foot: tuple[float, float]) -> Array:
    return np.array([*foot, 0.0])[:, None, None]


def _posture(
    t: Series, T: Array, hip: Series, soles: Mapping[str, Series], arms: Mapping[str, tuple[tuple[float, float], ...]]
) -> tuple[dict[str, Series], dict[str, Array]]:
    """Angles of all joints, and the cosine of each knee: upright torso, flat soles."""
    angles: dict[str, Series] = {"HeadYaw": t * 0.0, "HeadPitch": t * 0.0}
    reach = {}
    for side, sign in (("L", 1.0), ("R", -1.0)):
        to_ankle = soles[side] + np.array([0.0, -sign * HIP_Y, HIP_Z + ANKLE])[:, None, None] - hip
        roll = atan2(to_ankle[1], -to_ankle[2])
        down = sqrt(to_ankle[1] * to_ankle[1] + to_ankle[2] * to_ankle[2])
        cosine = (to_ankle[0] * to_ankle[0] + down * down - (THIGH**2 + TIBIA**2)) / (2.0 * THIGH * TIBIA)  # (5), (6)
        sine = sqrt(1.0 - cosine * cosine)
        knee = atan2(sine, cosine)
        pitch = atan2(-to_ankle[0], down) - atan2(TIBIA * sine, THIGH + TIBIA * cosine)
        values = (t * 0.0, roll, pitch, knee, -(pitch + knee), -roll)
        angles |= {f"{side}{name}": value for name, value in zip(LEG, values, strict=True)}
        reach[side] = cosine.d(0)
        shoulder, elbow = (cubic(t, T, ends, (0.0, 0.0)) for ends in arms[side])
        constant = [t * 0.0 + value for value in (sign * 0.26, -sign * 1.5, 0.0)]
        values = (shoulder, constant[0], constant[1], elbow, constant[2])
        angles |= {f"{side}{name}": value for name, value in zip(ARM, values, strict=True)}
    return angles, reach


def _links(robot: Mapping[str, Any], hip: Series, angles: Mapping[str, Series]) -> dict[str, Link]:
    """Motion of all links, from the torso outwards."""
    still = hip.like(np.broadcast_to(np.eye(3)[:, :, None, None], (3, 3, *hip.c.shape[2:])))
    frames = {"torso": (still, hip)}
    found = {"torso": _link("", robot, "torso", still, hip, np.zeros_like(hip.d(0)))}
    waiting = dict(robot["joints"])
    while waiting:
        for name, joint in list(waiting.items()):
            if joint["parent"] not in frames:
                continue
            del waiting[name]
            turned, place = frames[joint["parent"]]
            axis = np.array(joint["axis"])
            own = _product(turned, _rotation(axis / np.linalg.norm(axis), angles[name]))
            place = place + _applied(turned, np.array(joint["origin_m"]))
            frames[joint["child"]] = own, place
            axis_now = np.einsum("ij...,j->i...", turned.d(0), axis / np.linalg.norm(axis))
            found[joint["child"]] = _link(name, robot, joint["child"], own, place, axis_now)
    return found


def _link(joint: str, robot: Mapping[str, Any], name: str, R: Series, place: Series, axis: Array) -> Link:
    data = robot["links"][name]
    xx, yy, zz, xy, xz, yz = data["inertia_com_kgm2"]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    centre = place + _applied(R, np.array(data["com_m"]))
    # R' = W R and R'' = (W' + W W) R with W the skew matrix of the angular velocity.
    R0, R1, R2 = (R.d(k) for k in range(3))
    W = np.einsum("ik...,jk...->ij...", R1, R0)
    dW = np.einsum("ik...,jk...->ij...", R2, R0) + np.einsum("ik...,jk...->ij...", R1, R1)
    rate, acceleration = (np.stack([S[2, 1], S[0, 2], S[1, 0]]) for S in (W, dW))
    I = np.einsum("ik...,kl,jl...->ij...", R0, inertia, R0)  # noqa: E741
    momentum = np.einsum("ij...,j...->i...", I, rate)
    moment = np.einsum("ij...,j...->i...", I, acceleration) + np.cross(rate, momentum, axis=0)
    force = data["mass_kg"] * (centre.d(2) + np.array([0.0, 0.0, GRAVITY])[:, None, None])
    return Link(
        joint=joint,
        place=place.d(0),
        axis=axis,
        force=force,
        moment=moment,
        centre=centre.d(0),
        mass=data["mass_kg"],
        acceleration=centre.d(2),
    )


def _rotation(axis: Array, angle: Series) -> Series:
    """Rodrigues' formula, (3, 3, N)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = sincos(angle)
    one = (
        np.eye(3)[None, :, :, None, None]
        * np.concatenate([np.ones(1), np.zeros(len(s.c) - 1)])[:, None, None, None, None]
    )
    sine, rest = s.c[:, None, None] * K[None, :, :, None, None], -c.c[:, None, None] * (K @ K)[None, :, :, None, None]
    rest[0] += (K @ K)[:, :, None, None]
    return Series(np.broadcast_to(one, rest.shape) + sine + rest)


def _product(A: Series, B: Series) -> Series:
    pairs = range(len(A.c))
    return Series([sum(np.einsum("ik...,kj...->ij...", A.c[j], B.c[k - j]) for j in range(k + 1)) for k in pairs])


def _applied(A: Series, v: Array) -> Series:
    return Series(np.einsum("nij...,j->ni...", A.c, v))


def _zmp(links: Iterable[Link], reading: Reading) -> tuple[Array, Array]:
    """Where the ground's force acts without a moment about x and y, and that force: eqs. (19), (20)."""
    chosen = list(links)
    if reading.as_printed:
        load = sum(link.mass * (link.acceleration[2] - GRAVITY) for link in chosen)
        places = [
            sum(
                link.mass * (link.centre[k] * (link.acceleration[2] - GRAVITY) - link.acceleration[k] * link.centre[2])
                for link in chosen
            )
            / load
            for k in range(2)
        ]
        return np.stack(places), load
    force = sum(link.force for link in chosen)
    moment = sum(link.moment + np.cross(link.centre, link.force, axis=0) for link in chosen)
    return np.stack([-moment[1], moment[0]]) / force[2], force[2]


def _half(links: Mapping[str, Link], side: str, share: Array) -> list[Link]:
    """A leg, an arm and a share of the trunk."""
    own = [link for link in links.values() if link.joint[:1] == side]
    for name in TRUNK:
        part = links[name]
        own.append(replace(part, force=share * part.force, moment=share * part.moment, mass=share * part.mass))
    return own


def _torques(
    links: Mapping[str, Link], stands: Mapping[str, Array | None], robot: Mapping[str, Any]
) -> dict[str, Array]:
    """Torque of each joint: of a leg that stands what all above asks for, else what all beyond asks for.

    Args:
        links: all of them.
        stands: legs that stand, with the share of the trunk; None where one leg carries all.
        robot: for who carries whom.
    """
    joints = robot["joints"]
    beyond: dict[str, set[str]] = {}

    def carried(joint: str) -> set[str]:
        if joint not in beyond:
            child = joints[joint]["child"]
            nexts = (carried(name) for name, other in joints.items() if other["parent"] == child)
            beyond[joint] = {child}.union(*nexts)
        return beyond[joint]

    found = {}
    for joint in JOINTS:
        own = links[joints[joint]["child"]]
        outer = carried(joint)
        side = joint[0]
        if joint[1:] in LEG and side in stands:
            share = stands[side]
            above = links.values() if share is None else _half(links, side, share)
            parts, sign = (
                [link for link in above if not any(link.joint and link is links[name] for name in outer)],
                -1.0,
            )
        else:
            parts, sign = [links[name] for name in outer], 1.0
        total = sum(part.moment + np.cross(part.centre - own.place, part.force, axis=0) for part in parts)
        found[joint] = sign * np.sum(own.axis * total, axis=0)
    return found


def _margin(zmp: Array, foot: float, front: float, back: float) -> Array:
    """Eqs. (21), (22) with the jump at the ankle; outside the sole, where they say zero, how far outside, below zero."""
    return np.where(zmp >= foot, foot + front - zmp, zmp - (foot - back))


def _collected(
    torque: Mapping[str, Array],
    angles: Mapping[str, Series],
    reach: Mapping[str, Array],
    margins: Iterable[Array],
    T: Array,
) -> dict[str, Array]:
    """Objective, rows, metrics, each (P,)."""
    drawn = sum(np.abs(torque[name] * angles[name].d(1)) + HEAT * torque[name] ** 2 for name in JOINTS)
    samples = len(T)
    weights = np.full(samples, 1.0)
    weights[[0, -1]] = 0.5
    found = {"power_W": weights @ drawn / (samples - 1)}  # (32), trapezoids
    found |= {f"joint_angle[{name}, {k}]": q for name in JOINTS for k, q in enumerate(angles[name].d(0))}
    sides = {"L": "left", "R": "right"}
    found |= {f"reach[{sides[side]} leg, {k}]": value for side in "LR" for k, value in enumerate(reach[side])}
    changes = {name: np.diff(torque[name], axis=0) for name in JOINTS}
    found |= {f"torque_change[{name}, {k}]": value for name in JOINTS for k, value in enumerate(changes[name])}
    for letter, margin in zip("xy", margins, strict=True):
        found |= {f"dbm_{letter}[{k}]": value for k, value in enumerate(margin)}
        found |= {f"dbm_{letter}_mean": margin.mean(axis=0), f"dbm_{letter}_min_m": margin.min(axis=0)}
        found |= {f"dbm_{letter}_mean_m": margin.mean(axis=0)}
    found["torque_change_Nm"] = np.max([np.abs(change).max(axis=0) for change in changes.values()], axis=0)
    return found
