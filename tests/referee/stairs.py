"""The planned step on stairs of Bhardwaj and others for many x at once, phase by phase in time as the paper writes it.

Origin: the ankle of the stance foot. Angles of legs and feet turn clockwise from the forward axis, the torso's against it.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from tests.referee.series import Array, Series, atan2, exp, sincos, sqrt, stack, time

GRAVITY = 9.81
# Table I: length [m], mass [kg]; slender rods.
RODS = {
    **{"HK": (0.40, 6.0), "KA": (0.40, 4.0), "HK'": (0.40, 6.0), "K'A'": (0.40, 4.0), "UH": (0.30, 30.0)},
    **{"AS": (0.12, 0.70), "ST": (0.05, 0.15), "A'S'": (0.12, 0.70), "S'T'": (0.05, 0.15)},
}
MOVING = tuple(RODS)[:7]
PHASES = ("heel rises", "sole rises", "catch the cycloid", "track the cycloid")
T3, SOLE_ANGLE, TOE_ANGLE, CATCH = 3.5, np.pi / 6, np.pi / 6, 0.01  # Table III
PARTS = 10  # of each phase
QUANTUM = 0.01  # (43)
FRICTION, SETBACK, EDGE = 0.6, 0.06, 0.003
FOOT = RODS["A'S'"][0] + RODS["S'T'"][0]


class Moment(NamedTuple):
    """The planned step at some instants of one phase."""

    hip: Series
    ankle: Series
    sole: Series
    toe: Series


def step(X: Array, length: float = 0.508, ratio: float = 0.70) -> dict[str, Array]:
    """Objective, rows and metrics by name, each (P,), at X (P, 11) on a double step of this length [m]."""
    x = dict(zip(("z", "hip", "zmp0", "zmp1", "rate", "torso", "t1", "t2", "t_bc", "pitch", "share"), X.T, strict=True))
    run, rise = length / 2, ratio * length / 2
    ends = np.stack([np.zeros(len(X)), x["t1"], x["t2"], x["t_bc"], np.full(len(X), T3)])
    found = {f"phase_duration[{name}]": d for name, d in zip(PHASES, np.diff(ends, axis=0), strict=True)}
    parts, heights = [], []
    for phase in range(4):
        duration = ends[phase + 1] - ends[phase]
        s = np.linspace(0.0, 1.0, PARTS + 1)[:, None]
        parts.append(_posed(_planned(phase, ends[phase] + s * duration, ends, x, run, rise), x["torso"]))
        if phase > 1:  # four times as dense, not while the toe leaves or meets the ground
            fine = np.linspace(0.1, 1.0, 4 * PARTS + 1)[:, None]
            at = ends[phase] + (fine if phase == 2 else 1.0 - fine[::-1]) * duration
            heights.append(_clearance(_planned(phase, at, ends, x, run, rise), run, rise))
    q = {link: np.stack([[part[0][link].d(k) for k in range(3)] for part in parts]) for link in MOVING}
    q = {link: np.concatenate(list(value), axis=1) for link, value in q.items()}  # (3, m, P)
    for name, k in (("swing", 0), ("stance", 1)):
        found |= {f"reach[{name}, {i}]": v for i, v in enumerate(np.concatenate([part[1][k] for part in parts]))}
    for link in MOVING:
        found |= {f"link_angle[{link}, {i}]": value for i, value in enumerate(q[link][0])}
        found |= {f"link_acceleration[{link}, {i}]": value for i, value in enumerate(q[link][2])}
    for knee, thigh, shank in (("knee", "HK", "KA"), ("knee'", "HK'", "K'A'")):
        found |= {f"knee_angle[{knee}, {i}]": value for i, value in enumerate(q[shank][0] - q[thigh][0])}
    for k, name in enumerate(("toe", "sole", "ankle")):
        found |= {f"clearance[{name}, {i}]": v for i, v in enumerate(np.concatenate([h[k] for h in heights]))}
    t = np.concatenate([ends[p] + np.linspace(0, 1, PARTS + 1)[:, None] * (ends[p + 1] - ends[p]) for p in range(4)])
    return found | _loaded(q, t, x)


def _planned(phase: int, t: Array, ends: Array, x: Mapping[str, Array], run: float, rise: float) -> Moment:
    """Hip, swing ankle and foot at instants t (m, P) of a phase."""
    now = time(t, 2)
    u = (now - ends[phase]) / (ends[phase + 1] - ends[phase])  # share of the phase that has passed
    smooth = u * u * (3.0 - 2.0 * u)
    l6, l7 = RODS["AS"][0], RODS["ST"][0]
    lifted = l7 * np.array([1.0 - np.cos(TOE_ANGLE), np.sin(TOE_ANGLE)])
    none = now * 0.0
    if phase < 2:  # (1) to (4), the second piece with (t - t1) / (t2 - t1)
        sole, toe = (SOLE_ANGLE * smooth, none) if phase == 0 else (SOLE_ANGLE * (1.0 - smooth), TOE_ANGLE * smooth)
        (s6, c6), (s7, c7) = sincos(sole), sincos(toe)
        ankle = stack([l6 * (1.0 - c6) + l7 * (1.0 - c7), l6 * s6 + l7 * s7])
    else:
        # Once flat, the foot stands two treads on; a stair flatter than 2 / pi stretches the cycloid.
        radius, wide = rise, max(rise, 2.0 * run / np.pi)
        first = _first_angle(np.pi - 2.0 * run / wide)  # (7)
        caught = first + 2.0 * CATCH

        def cycloid(angle: Series) -> Series:  # (5), (6)
            s, c = sincos(angle)
            return stack([lifted[0] + 2.0 * run + wide * (angle - s - np.pi), lifted[1] + radius * (1.0 - c)])

        if phase == 2:
            p4 = cycloid(none + caught).d(0)
            p1 = np.broadcast_to(lifted[:, None, None], p4.shape)
            p2 = p1 + np.array([0.0, radius * (1.0 - np.cos(first))])[:, None, None]  # (8), (9)
            p3 = p4 - CATCH * np.array([wide * (1.0 - np.cos(caught)), radius * np.sin(caught)])[:, None, None]
            b = u * u * (2.0 - u)  # no jump of the velocity at either end
            rest = 1.0 - b
            # (10), (11) with the binomial factors.
            weights = rest * rest * rest, 3.0 * rest * rest * b, 3.0 * rest * b * b, b * b * b
            ankle = stack([sum(w * p[k] for w, p in zip(weights, (p1, p2, p3, p4), strict=True)) for k in range(2)])
            straight = smooth
        else:
            span = ends[4] - ends[3]
            begin = 3.0 * CATCH / (ends[3] - ends[2])  # (12): the bridge ends along the cycloid at this rate
            change = np.pi - caught
            c2 = (3.0 * change / span - 2.0 * begin - x["rate"]) / span
            c3 = (begin + x["rate"] - 2.0 * change / span) / span**2
            local = now - ends[3]
            ankle = cycloid(caught + local * (begin + local * (c2 + local * c3)))  # (13), (14)
            straight = 1.0 - u * u * u * u * (5.0 - 4.0 * u)
        sole, toe = -(straight * x["pitch"]), TOE_ANGLE - straight * (TOE_ANGLE + x["pitch"])
    origin = np.array([run, rise])[:, None, None]
    return Moment(_hip(now, x, run, rise) - origin, ankle - origin, sole, toe)


def _first_angle(m: float) -> float:
    """Root of angle - sin(angle) = m by bisection; a flat stair begins its cycloid at about 2e-5 rad, not at zero."""
    low, high, m = 0.0, np.pi, max(m, 1e-15)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if middle - np.sin(middle) < m else (low, middle)
    return (low + high) / 2


def _hip(now: Series, x: Mapping[str, Array], run: float, rise: float) -> Series:
    """(21) to (26); the arc rises from the start of its chord."""
    w = np.sqrt(GRAVITY / x["z"])  # (24)
    moved = run + x["zmp1"] - x["zmp0"]
    a2, a3 = 3.0 * moved / T3**2, -2.0 * moved / T3**3

    def particular(t: Series | float) -> Series:
        return x["zmp0"] + t * t * (a2 + t * a3) + (6.0 * a3 * t + 2.0 * a2) / w**2  # (23) without C1 and C2

    start, end = x["hip"] - particular(0.0), x["hip"] + run - particular(T3)
    up, down = np.exp(w * T3), np.exp(-w * T3)
    c1, c2 = (end - start * down) / (up - down), (start * up - end) / (up - down)
    along = particular(now) + c1 * exp(now * w) + c2 * exp(-(now * w))
    half = np.arctan2(rise, run)
    radius = run / np.sin(2.0 * half)
    ahead = along - x["hip"]
    return stack([along, x["z"] + radius - sqrt(radius**2 - ahead * ahead)])  # (25)


def _posed(at: Moment, torso: Array) -> tuple[dict[str, Series], tuple[Array, Array]]:
    """Absolute angles of the moving links, and the cosines of both knees, by (27), (28)."""
    thigh, shank = RODS["HK"][0], RODS["KA"][0]
    found, cosines = {}, []
    for links, ankle in ((("HK", "KA"), at.ankle), (("HK'", "K'A'"), at.hip * 0.0)):
        line = ankle - at.hip
        cosine = (line[0] * line[0] + line[1] * line[1] - (thigh**2 + shank**2)) / (2.0 * thigh * shank)
        sine = sqrt(1.0 - cosine * cosine)
        first = atan2(-line[1], line[0]) - atan2(shank * sine, thigh + shank * cosine)
        found |= {links[0]: first, links[1]: first + atan2(sine, cosine)}
        cosines.append(cosine.d(0))
    found |= {"UH": at.sole * 0.0 + torso, "AS": at.sole, "ST": at.toe}
    return found, (cosines[0], cosines[1])


def _clearance(at: Moment, run: float, rise: float) -> tuple[Array, ...]:
    """Heights of toe, sole and ankle above the stair; NaN where a leg does not reach, which happens between samples too."""
    with np.errstate(invalid="ignore", divide="ignore"):
        reached = np.all([cosine < 1.0 for cosine in _posed(at, np.zeros(at.hip.c.shape[-1]))[1]], axis=0)
    angles = (at.sole.d(0), at.toe.d(0))
    points = [at.ankle.d(0)]
    for name, angle in zip(("AS", "ST"), angles, strict=True):
        points.append(points[-1] + RODS[name][0] * np.stack([np.cos(angle), -np.sin(angle)]))

    def ground(x: Array) -> Array:
        return rise * (sum(1.0 / (1.0 + np.exp(-(x + SETBACK - edge) / EDGE)) for edge in (0.0, run)) - 1.0)

    return tuple(np.where(reached, point[1] - ground(point[0]), np.nan) for point in reversed(points))


class Body(NamedTuple):
    """A link: centre and its acceleration with gravity (2, m, P), mass, clockwise moment that turns it."""

    centre: Array
    lifted: Array
    mass: float
    moment: Array


class Loads(NamedTuple):
    """What joints and ground give."""

    torque: dict[str, Array]  #: by joint, (m, P) [Nm]
    turned: dict[str, Array]  #: by joint, angle, rate and acceleration (3, m, P)
    stance: Array  #: force of the ground on the stance foot (2, m, P) [N]
    pressure: Array  #: its centre ahead of the stance ankle (m, P) [m]; NaN where nothing loads the foot


def loads(q: Mapping[str, Array], rear: Callable[[Array], Mapping[str, Array]]) -> Loads:
    """What carries a part of the robot gives the rate of its momentum, and of its moment.

    Args:
        q: by moving link, angle, rate and acceleration (3, m, P).
        rear: forces of the ground (2, m, P) by the point of the rear foot, of the whole ground's force.
    """
    still = np.zeros_like(q["HK"])
    moved = {"A'": np.zeros((3, 2, *still.shape[1:]))}  # value, velocity, acceleration
    bodies = {}
    ways = {"K'A'": ("A'", "K'", -1), "HK'": ("K'", "H", -1), "UH": ("H", "U", 1), "HK": ("H", "K", 1)}
    ways |= {"KA": ("K", "A", 1), "AS": ("A", "S", 1), "ST": ("S", "T", 1)}
    ways |= {"A'S'": ("A'", "S'", 1), "S'T'": ("S'", "T'", 1)}
    for link, (near, far, sense) in ways.items():
        length, mass = RODS[link]
        angle, rate, acceleration = q.get(link, still)
        turn = 1.0 if link == "UH" else -1.0
        ahead = np.stack([np.cos(angle), turn * np.sin(angle)])
        aside = np.stack([-np.sin(angle), turn * np.cos(angle)])
        rod = sense * length * np.stack([ahead, aside * rate, aside * acceleration - ahead * rate**2])
        moved[far] = moved[near] + rod
        middle = moved[near] + rod / 2
        lifted = middle[2] + np.array([0.0, GRAVITY])[:, None, None]
        bodies[link] = Body(middle[0], lifted, mass, -turn * mass * length**2 / 12 * acceleration)
    places = {name: place[0] for name, place in moved.items()}
    whole = sum(body.mass * body.lifted for body in bodies.values())
    behind = rear(whole)
    stance = whole - sum(behind.values())

    def asked(links: tuple[str, ...], about: str) -> Array:
        """Clockwise moment about a point that the links need from what carries them; the rear foot's ground helps."""
        base = places[about]
        total = sum(b.moment + _clockwise(b.centre - base, b.mass * b.lifted) for b in (bodies[link] for link in links))
        # Every part that is asked for ends in the rear toe; the sole's force has no arm about the sole.
        return total - sum(_clockwise(places[point] - base, force) for point, force in behind.items())

    swing = ("HK", "KA", "AS", "ST")
    torque = {
        "ankle'": asked((*swing, "UH", "HK'", "K'A'"), "A'"),
        "knee'": asked((*swing, "UH", "HK'"), "K'"),
        "hip'": -asked((*swing, "UH"), "H"),
        "hip": asked(swing, "H"),
        "knee": asked(swing[1:], "K"),
        "ankle": asked(swing[2:], "A"),
        "toe": asked(swing[3:], "S"),
    }
    # Rates of the joints; the torso turns against the legs.
    pairs = {"ankle'": ("K'A'", None), "knee'": ("HK'", "K'A'"), "hip'": ("HK'", "UH"), "hip": ("HK", "UH")}
    pairs |= {"knee": ("KA", "HK"), "ankle": ("AS", "KA"), "toe": ("ST", "AS")}
    turned = {}
    for joint, (link, base) in pairs.items():
        turned[joint] = q[link] - (0.0 if base is None else -q[base] if base == "UH" else q[base])
    carried = stance[1] > 0.01 * sum(mass for _, mass in RODS.values()) * GRAVITY
    pressure = np.where(carried, -asked(tuple(RODS), "A'") / np.where(carried, stance[1], 1.0), np.nan)
    return Loads(torque, turned, stance, pressure)


def _loaded(q: Mapping[str, Array], t: Array, x: Mapping[str, Array]) -> dict[str, Array]:
    """Rows of the ground's forces, energy and peaks of a planned step."""
    passed = np.minimum(t / x["t2"], 1.0)
    share = x["share"] * (1.0 - passed**2 * (3.0 - 2.0 * passed))
    torque, turned, stance, pressure = loads(q, lambda whole: {"T": share * whole})
    found = {f"stance_load[z, {i}]": value for i, value in enumerate(stance[1])}
    found |= {f"stance_zmp[x, {i}]": value for i, value in enumerate(pressure)}
    for way, sign in (("forward", -1.0), ("backward", 1.0)):  # |F_x| <= mu F_z
        found |= {f"friction[{way}, {i}]": v for i, v in enumerate(FRICTION * stance[1] + sign * stance[0])}
    power = sum(np.abs(torque[joint] * turned[joint][1]) for joint in torque)
    gaps = np.diff(t, axis=0)
    found["energy_J"] = np.sum(gaps * (power[1:] + power[:-1]) / 2, axis=0)  # phases meet without a gap
    gaps[PARTS :: PARTS + 1] = QUANTUM
    jerks = [np.abs(np.diff(turned[joint][2], axis=0) / gaps) for joint in turned]
    found["peak_jerk_rad_s3"] = np.max([jerk.max(axis=0) for jerk in jerks], axis=0)
    found["peak_acceleration_rad_s2"] = np.max([np.abs(turned[j][2]).max(axis=0) for j in turned], axis=0)
    found["peak_torque_Nm"] = np.max([np.abs(torque[j]).max(axis=0) for j in torque], axis=0)
    found["zmp_margin_min_m"] = np.minimum(pressure, FOOT - pressure).min(axis=0)
    return found


def _clockwise(arm: Array, force: Array) -> Array:
    """Moment in the plane x, z about y, which points to the left."""
    return arm[1] * force[0] - arm[0] * force[1]
