"""Planar biped with toes that climbs stairs: nine slender rods, their points, dynamics and loads (Bhardwaj et al., eqs. 35-42).

All angles are absolute. Those of legs and feet turn clockwise from the forward axis x (a leg that hangs down has pi / 2), that of
the torso turns counter-clockwise. Primes mark the stance leg, whose ankle is the base.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Generic, NamedTuple, TypeVar

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.decoding import decode
from nlp_gait.symbolic.dynamics import EquationsOfMotion, equations_of_motion

FILE = resources.files("nlp_gait.gaits.stairs") / "biped.json"
GRAVITY = 9.81  # [m/s^2]
# Order of the angles, as in the paper's Table I: thigh, shank of both legs, torso, sole and toe of both feet.
LINKS = ("HK", "KA", "HK'", "K'A'", "UH", "AS", "ST", "A'S'", "S'T'")
# Ends of every link.
ENDS = {
    "HK": ("H", "K"),
    "KA": ("K", "A"),
    "HK'": ("H", "K'"),
    "K'A'": ("K'", "A'"),
    "UH": ("H", "U"),
    "AS": ("A", "S"),
    "ST": ("S", "T"),
    "A'S'": ("A'", "S'"),
    "S'T'": ("S'", "T'"),
}
# Links in the order in which they are reached from the stance ankle or the hip, and whether they are passed from their far end.
_SWING = (("UH", 1), ("HK", 1), ("KA", 1), ("AS", 1), ("ST", 1))
_FOOT = (("A'S'", 1), ("S'T'", 1))
_PATHS: Mapping[str, tuple[tuple[str, int], ...]] = {
    "A'": (("K'A'", -1), ("HK'", -1), *_SWING, *_FOOT),
    "H": (*_SWING, ("HK'", 1), ("K'A'", 1), *_FOOT),
}

V = TypeVar("V", SX, np.ndarray)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanarLink:
    """Slender rod."""

    name: str  # its two ends, for example ``"HK"``
    length_m: float  # between the ends
    mass_kg: float  # uniformly distributed

    @property
    def inertia_kgm2(self) -> float:
        """Moment of inertia about the middle."""
        return self.mass_kg * self.length_m**2 / 12


@dataclass(frozen=True, slots=True, kw_only=True)
class ToeFootBiped:
    """Two legs of thigh, shank, sole and toe, and a torso.

    Source:
        Bhardwaj, Mishra, Sukavanam, Balasubramanian, Table I. The paper gives no moments of inertia: m l^2 / 12.
    """

    name: str  # of the robot
    source: str  # of the numbers
    inertia: str  # formula of the moments of inertia
    links: tuple[PlanarLink, ...]  # in the order of ``LINKS``; both legs are equal

    def link(self, name: str) -> PlanarLink:
        return self.links[LINKS.index(name)]

    @property
    def mass_kg(self) -> float:
        return math.fsum(link.mass_kg for link in self.links)

    @property
    def sole_m(self) -> float:
        """Ankle to sole joint."""
        return self.link("AS").length_m

    @property
    def toe_m(self) -> float:
        """Sole joint to tip of the toe."""
        return self.link("ST").length_m

    @property
    def foot_m(self) -> float:
        """Ankle to tip of the toe, flat."""
        return self.sole_m + self.toe_m


@cache
def load_toe_foot_biped() -> ToeFootBiped:
    """Return the paper's robot."""
    return decode(ToeFootBiped, json.loads(FILE.read_text(encoding="utf-8")))


def get_rod(link: str) -> PlanarLink:
    """Return a link of the paper's robot."""
    return load_toe_foot_biped().link(link)


def compute_direction(link: str, angle: SX) -> SX:
    """(2,) unit vector along a link, from its first end to its second; z up."""
    upward = 1 if link == "UH" else -1
    return ca.vertcat(ca.cos(angle), upward * ca.sin(angle))


def locate_points(q: Sequence[SX] | SX, place: SX, base: str = "A'") -> dict[str, SX]:
    """Return joints and ends by name, (2,) each [m], from nine angles [rad] and the place (2,) of a base: A' or the hip H."""
    return sum_along_links(
        base, place, lambda link: get_rod(link).length_m * compute_direction(link, q[LINKS.index(link)])
    )


def sum_along_links(base: str, place: V, along: Callable[[str], V]) -> dict[str, V]:
    """Return sums along the links from the base to every point, by the point's name."""
    places = {base: place}
    for link, sense in _PATHS[base]:
        near, far = ENDS[link][::sense]
        places[far] = places[near] + sense * along(link)
    return places


def _compute_couplings(base: str) -> np.ndarray:
    """(9, 9) W [kg m^2]: the links' centres move with K = sum_ij W_ij (du_i/dt . du_j/dt) / 2, where u_i are the directions."""
    unit = dict(zip(LINKS, np.eye(len(LINKS)), strict=True))
    arms = sum_along_links(base, np.zeros(len(LINKS)), lambda link: get_rod(link).length_m * unit[link])
    middles = np.array([(arms[a] + arms[b]) / 2 for a, b in ENDS.values()])
    return middles.T @ np.diag([get_rod(link).mass_kg for link in LINKS]) @ middles


def locate_centres(places: Mapping[str, SX]) -> dict[str, SX]:
    """Centres of mass by link, (2,) each [m], from the points."""
    return {link: (places[a] + places[b]) / 2 for link, (a, b) in ENDS.items()}


def compute_moment(place: SX, force: SX) -> SX:
    """Return the moment of a force about the origin, counter-clockwise [N m]."""
    return place[0] * force[1] - place[1] * force[0]


def compute_spin_moment(spins: SX) -> SX:
    """Return the counter-clockwise moment that turns all links, from the second derivatives of their angles (9,) [N m]."""
    return sum(
        (get_rod(link).inertia_kgm2 * spins[i] * (1 if link == "UH" else -1) for i, link in enumerate(LINKS)), SX(0)
    )


def make_dynamics(q: SX, qd: SX, angles: SX, base: str = "A'") -> EquationsOfMotion:
    """Return the equations of motion about a fixed base (``locate_points``); link angles (9,) [rad] are functions of q (n,)."""
    spins = ca.jtimes(angles, q, qd)
    velocities = [ca.jtimes(compute_direction(link, angles[i]), q, qd) for i, link in enumerate(LINKS)]
    middles = locate_centres(locate_points(angles, SX(2, 1), base))
    kinetic, potential, couplings = SX(0), SX(0), _compute_couplings(base)
    for i, link in enumerate(LINKS):
        moving = 0.5 * couplings[i, i] * ca.sumsqr(velocities[i])
        kinetic += 0.5 * get_rod(link).inertia_kgm2 * spins[i] ** 2 + moving  # (eqs. 36, 37)
        for j in range(i):
            if couplings[i, j] != 0.0:
                kinetic += couplings[i, j] * ca.dot(velocities[i], velocities[j])
        potential += get_rod(link).mass_kg * GRAVITY * middles[link][1]  # (eq. 38)
    return equations_of_motion(kinetic, potential, q, qd)


# Links that move while the stance foot stands flat: coordinates q of the model.
MOVING = LINKS[:7]
# Angles of joints as sums of absolute angles, between two links; the torso's angle runs the other way.
JOINT_ANGLES: Mapping[str, Mapping[str, int]] = {
    "hip": {"HK": 1, "UH": 1},
    "knee": {"KA": 1, "HK": -1},
    "hip'": {"HK'": 1, "UH": 1},
    "knee'": {"K'A'": 1, "HK'": -1},
    "ankle'": {"K'A'": 1, "A'S'": -1},
    "ankle": {"AS": 1, "KA": -1},
    "toe": {"ST": 1, "AS": -1},
    "toe'": {"S'T'": 1, "A'S'": -1},
}
# Joints between them, from the stance foot to the swing toe; their rates are JOINT_RATES @ qd.
JOINTS = ("ankle'", "knee'", "hip'", "hip", "knee", "ankle", "toe")
JOINT_RATES = np.array([[JOINT_ANGLES[joint].get(link, 0) for link in MOVING] for joint in JOINTS])
# In free fall there is no pressure below the foot: a smaller stance force counts as this share of the weight in its centre.
LEAST_LOAD = 1e-3


E = TypeVar("E")


class StanceLoads(NamedTuple, Generic[E]):
    """Joint torques and ground reaction."""

    torque: E  # (7,) of the joints [Nm], in the order of JOINTS
    stance_force: E  # (2,) of the ground on the stance foot [N]
    stance_pressure: E  # its centre of pressure, ahead of the stance ankle [m]


def link_angles(q: SX) -> SX:
    """(9,) absolute angles of all links with the stance foot flat [rad], from q (7,)."""
    return ca.vertcat(q, 0, 0)


def compute_loads(q: SX, qd: SX, qdd: SX, rear: Mapping[str, SX]) -> StanceLoads[SX]:
    """Return the inverse dynamics of the moving links, q (7,) [rad], with given forces (2,) [N] on points of the rear foot.

    Derivatives are taken with respect to q and qd, which are symbols. The centre of pressure follows from the moment balance of
    the flat stance foot.
    """
    motion = make_dynamics(q, qd, link_angles(q))
    places = locate_points(link_angles(q), SX(2, 1))
    generalised = motion.M @ qdd + motion.C @ qd + motion.G  # (eq. 42)
    for point, force in rear.items():
        generalised -= ca.jacobian(places[point], q).T @ force  # (eq. 35)
    torque = DM(np.linalg.inv(JOINT_RATES.T)) @ generalised

    middles = locate_centres(places)
    weight = load_toe_foot_biped().mass_kg * GRAVITY
    momentum = sum((get_rod(link).mass_kg * ca.jtimes(middles[link], q, qd) for link in LINKS), SX(2, 1))
    force = ca.jtimes(momentum, q, qd) + ca.jtimes(momentum, qd, qdd) + ca.vertcat(0, weight)
    stance = force - sum(rear.values(), SX(2, 1))
    foot = sum((get_rod(link).mass_kg * GRAVITY * middles[link][0] for link in ("A'S'", "S'T'")), SX(0))
    load = ca.fmax(stance[1], LEAST_LOAD * weight)
    return StanceLoads(torque, stance, (foot - torque[0]) / load)


@cache
def make_loads(*rear: str) -> ca.Function:
    """Return the function of q, qd, qdd (7,) and forces (2,) on points of the rear foot, T or S, to ``compute_loads``."""
    q, qd, qdd = (SX.sym(name, len(MOVING)) for name in ("q", "qd", "qdd"))
    forces = {point: SX.sym({"T": "toe", "S": "sole"}[point], 2) for point in rear}
    return ca.Function("loads", [q, qd, qdd, *forces.values()], ca.cse([*compute_loads(q, qd, qdd, forces)]))
