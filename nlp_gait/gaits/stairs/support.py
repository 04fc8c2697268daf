"""Balance as the paper checks it: the ZMP of (49) in the convex hull of the contact points, and the torques that follow."""

from typing import NamedTuple

import casadi as ca
from casadi import SX

from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs.planned_motion import Posture, StairPlan, StepKind, landing_share
from nlp_gait.symbolic.trajectories import Motion

_FOOT, _SWING = ("A'S'", "S'T'"), ("HK", "KA", "AS", "ST")
# Of each joint: its point, the links on the side away from the stance toe, whether its torque turns these clockwise, and the two
# links between which it is: its rate is the difference of theirs, or their sum for the torso, which turns counter-clockwise.
JOINT_SIDES = {
    "ankle'": ("A'", ("K'A'", "HK'", "UH", *_SWING), 1, ("K'A'", "A'S'")),
    "knee'": ("K'", ("HK'", "UH", *_SWING), 1, ("HK'", "K'A'")),
    "hip'": ("H", ("UH", *_SWING), -1, ("HK'", "UH")),
    "hip": ("H", _SWING, 1, ("HK", "UH")),
    "knee": ("K", ("KA", "AS", "ST"), 1, ("KA", "HK")),
    "ankle": ("A", ("AS", "ST"), 1, ("AS", "KA")),
    "toe": ("S", ("ST",), 1, ("ST", "AS")),
    "toe'": ("S'", ("A'S'", "K'A'", "HK'", "UH", *_SWING), 1, ("A'S'", "S'T'")),
}
LEAST_ARM = 1.0  # of the force on the rear foot about the centre of pressure of the other one [N m]


class Balance(NamedTuple):
    """Ground reaction and torques of the whole robot at one instant."""

    torque: SX  # (8,) in the order of JOINT_SIDES [Nm]
    power: SX  # (8,) [W]
    stance_force: SX  # (2,) of the ground on the stance foot [N]
    stance_pressure: SX  # its centre, ahead of the ankle of the flat stance foot [m]
    zmp: SX  # (eq. 49) as printed: point masses, on the virtual slope in all phases; from the same point [m]
    support: SX  # (2,) rear and front end of the contact points [m]


def compute_balance(step: Posture, plan: StairPlan, s: SX, passing: SX, slope: SX, kind: StepKind) -> Balance:
    """Return ZMP, contact points and torques at fractions s (4,) of the phases, of which one is ``passing`` (4,).

    Both feet share the load so that the stance foot carries what it can with its centre of pressure between its contact points;
    the forces on them are parallel. In the first step the swing foot carries nothing.
    """
    q, v, a = (ca.vertcat(part, foot) for part, foot in zip(step.q, step.foot, strict=True))
    place = biped.points(q, step.stance_ankle.position)
    middles, accelerations = biped.centres(place), _accelerate_centres(Motion(q, v, a), step.stance_ankle)
    push = {
        link: biped.rod(link).mass_kg * (accelerations[link] + ca.vertcat(0, biped.GRAVITY)) for link in biped.LINKS
    }
    turn = {
        link: biped.rod(link).inertia_kgm2 * a[i] * (1 if link == "UH" else -1) for i, link in enumerate(biped.LINKS)
    }
    force = sum(push.values(), SX(2, 1))
    load = ca.fmax(force[1], biped.LEAST_LOAD * biped.GRAVITY * biped.toe_foot_biped().mass_kg)
    points = sum((_moment(middles[link], push[link]) for link in biped.LINKS), SX(0))
    moment = points + sum(turn.values(), SX(0))

    sole, toe, rear_sole, rear_toe = (place[name] for name in ("S'", "T'", "S", "T"))
    double = passing[0] + passing[1]
    rear = rear_toe[0] + passing[0] * (rear_sole[0] - rear_toe[0])
    heel = SX(0)
    if kind == "landing":
        on = landing_share(plan, s)
        heel = double * ((on > 1) * toe[0] + (on > 0) * (on <= 1) * sole[0])
    front = ca.fmin(ca.fmax(moment / load, heel), toe[0])
    back = ca.vertcat(ca.fmin(ca.fmax(moment / load, rear), rear_toe[0]), rear_toe[1])
    arm = ca.fmin(_moment(back, force) - front * load, -LEAST_ARM)
    share = SX(0) if kind == "first" else double * ca.fmin(ca.fmax((moment - front * load) / arm, 0), 1)

    torque, rate = [], []
    for joint, links, sense, between in JOINT_SIDES.values():
        total = sum((_moment(middles[link] - place[joint], push[link]) + turn[link] for link in links), SX(0))
        torque.append(-sense * (total - share * _moment(back - place[joint], force)))
        first, second = (v[biped.LINKS.index(link)] for link in between)
        rate.append(first + second if "UH" in between else first - second)
    pressure = (moment - share * _moment(back, force)) / ca.fmax((1 - share) * load, biped.LEAST_LOAD * load)
    behind = heel if kind == "first" else double * rear
    return Balance(
        ca.vertcat(*torque),
        ca.vertcat(*torque) * ca.vertcat(*rate),
        (1 - share) * force,
        pressure,
        points / ca.fmax(force[1] - slope * force[0], biped.LEAST_LOAD * load),  # (eq. 49)
        ca.vertcat(behind, toe[0]),
    )


def _accelerate_centres(q: Motion, ankle: Motion) -> dict[str, SX]:
    """Return the accelerations (2,) of the links' centres [m/s^2] from angles (9,) and the stance ankle."""

    def acceleration(link: str) -> SX:
        angle, rate, change = (part[biped.LINKS.index(link)] for part in q)
        normal = biped.direction(link, angle + ca.pi / 2)
        return biped.rod(link).length_m * (change * normal - rate**2 * biped.direction(link, angle))

    return biped.centres(biped.sum_along_links("A'", ankle.acceleration, acceleration))


def _moment(at: SX, force: SX) -> SX:
    """Moment of a force about the origin, counter-clockwise [N m]."""
    return at[0] * force[1] - at[1] * force[0]
