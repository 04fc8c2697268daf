"""Drawing and simulation of a step on the stairs: rods from the stance ankle, and for the engine a tree of rigid bodies.

Both legs lie in one plane and pass through each other. A foot is a rod on the ground, ankle included; a plate above it and the
shank touch the stairs. The leg with primes, which stands first, is the left one.
"""

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Columns, NumericPoint, Signals, SimulationModel
from nlp_gait.formulation.display import LEFT, RIGHT, SIMULATED, TRUNK, Limb, Skeleton, Tread
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs.stair import SETBACK
from nlp_gait.robots import Foot, Joint, Link, Robot
from nlp_gait.robots.robot import Vector

LINES = {RIGHT: ("H", "K", "A", "S", "T"), LEFT: ("H", "K'", "A'", "S'", "T'"), TRUNK: ("H", "U")}
# The paper has no motors. The largest torque of each is the robot's weight at a lever as long as what the joint moves: leg,
# shank, foot, toe. NAO's motors give 0.8 to 1.6 times that at stall (hip pitch; knee and ankle).
FOOT_HALF_WIDTH = 0.05  # [m]; has no effect in the plane
TORSO = "torso"
# Links of a leg from the hip down, by the name of the joint before them, with the paper's name and the link in front.
LEG = {"Hip": ("thigh", "HK"), "Knee": ("shank", "KA"), "Ankle": ("sole", "AS"), "Toe": ("toe", "ST")}
SIDES = {"L": ("left", "'"), "R": ("right", "")}
JOINTS = tuple(f"{letter}{joint}" for letter in SIDES for joint in LEG)
# The same joints of the planar model, whether they turn the same way, their angles in the zero pose, and by those of the links.
MODEL_JOINTS = tuple(f"{joint.lower()}{mark}" for _, mark in SIDES.values() for joint in LEG)
SENSES = np.array([-1.0 if joint == "ankle'" else 1.0 for joint in MODEL_JOINTS])
ZERO_POSE = np.array([np.pi, 0.0, -np.pi / 2, 0.0] * len(SIDES))
FROM_LINKS = SENSES * np.array([[biped.JOINT_ANGLES[j].get(link, 0) for j in MODEL_JOINTS] for link in biped.LINKS])


@cache
def make_rigid_bodies() -> Robot:
    """Return the tree from the torso, whose frame is at the hip; in the zero pose it stands upright with straight legs."""
    paper = biped.load_toe_foot_biped()
    levers = {"Hip": biped.get_rod("HK").length_m + biped.get_rod("KA").length_m, "Knee": biped.get_rod("KA").length_m}
    levers |= {"Ankle": paper.foot_m, "Toe": paper.toe_m}
    links = {TORSO: _link(TORSO, biped.get_rod("UH"), (0.0, 0.0, 1.0))}
    joints, feet, toes = {}, {}, {}
    for letter, (side, _) in SIDES.items():
        parent, origin = TORSO, (0.0, 0.0, 0.0)
        for joint, (segment, paper_name) in LEG.items():
            link, name = biped.get_rod(paper_name), f"{side} {segment}"
            along: Vector = (0.0, 0.0, -1.0) if joint in ("Hip", "Knee") else (1.0, 0.0, 0.0)
            links[name] = _link(name, link, along)
            joints[f"{letter}{joint}"] = Joint(
                name=f"{letter}{joint}",
                parent=parent,
                child=name,
                origin_m=origin,
                axis=(0.0, 1.0, 0.0),
                limits_rad=(-math.pi, math.pi),  # the paper has no limits of angles and speeds
                velocity_limit_rad_s=100.0,
                torque_limit_Nm=paper.mass_kg * biped.GRAVITY * levers[joint],
            )
            parent, origin = name, (link.length_m * along[0], link.length_m * along[1], link.length_m * along[2])
        feet[side], toes[side] = (
            _make_plate(f"{side} {segment}", biped.get_rod(of).length_m) for segment, of in (LEG["Ankle"], LEG["Toe"])
        )
    return Robot(
        name=paper.name,
        description="Planar biped of nine rods with toes",
        sources={"masses and lengths": paper.source, "inertias": paper.inertia},
        root=TORSO,
        links=links,
        joints=joints,
        feet=feet,
        toes=toes,
    )


def compute_joint_torques(model: Array, stance_toe: Array) -> Array:
    """Return joint torques (T, 8) from ``compute_loads``' (T, 7) and the standing toe's (T,), which these lack [Nm]."""
    names = (*biped.JOINTS, "toe'")
    return SENSES * np.column_stack([model, stance_toe])[:, [names.index(joint) for joint in MODEL_JOINTS]]


def _link(name: str, rod: biped.PlanarLink, along: Vector) -> Link:
    """Return a rod from its frame's origin along an axis; equal inertia about all axes, as it turns about one only."""
    x, y, z = (rod.length_m / 2 * component for component in along)
    moment = rod.inertia_kgm2
    tensor = (moment, moment, moment, 0.0, 0.0, 0.0)
    return Link(name=name, mass_kg=rod.mass_kg, com_m=(x, y, z), inertia_com_kgm2=tensor)


def _make_plate(link: str, length: float) -> Foot:
    half = FOOT_HALF_WIDTH
    return Foot(link=link, ankle_height_m=0.0, front_m=length, back_m=0.0, left_m=half, right_m=half)


def make_skeleton(signals: Signals, parameters: Mapping[str, float]) -> Skeleton:
    """Return the skeleton of the robot on its stair."""
    history = signals.arrays["link_q"]  # absolute angles of the moving links, or of all
    samples = len(signals.arrays["t"])
    if history.shape[1] == len(biped.MOVING):
        history = np.hstack([history, np.zeros((samples, 2))])
    places = _locate_points(history, signals.arrays.get("stance_ankle", np.zeros((samples, 2))))
    tread, rise = measure_stair(parameters)
    first, second = -SETBACK, tread - SETBACK
    edges = [(-1.6 * tread, -1), (first, -1), (first, 0), (second, 0), (second, 1), (1.8 * tread, 1)]
    ground = np.array([(x, level * rise) for x, level in edges])
    zmp = signals.arrays.get("zmp")
    if zmp is not None:
        zmp = _make_spatial(np.column_stack([zmp.reshape(samples, -1)[:, 0], np.zeros(samples)]))
    lines = {side: np.stack([_make_spatial(places[name]) for name in names], axis=1) for side, names in LINES.items()}
    limbs = tuple(Limb(side=side, points=points) for side, points in lines.items())
    return Skeleton(t=signals.arrays["t"], limbs=limbs, soles=(), ground=ground, com=None, zmp=zmp, planar=True)


def _make_spatial(points: Array) -> Array:
    """(T, 3) from (T, 2) of x and z."""
    return np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]])


class StepMotion(NamedTuple):
    """A step to simulate; rows are instants."""

    t: Array  # (T,) [s]
    q: Array  # (T, 9) absolute angles of all links in the order of LINKS [rad]
    qd: Array  # (T, 9) [rad/s]
    qdd: Array  # (T, 9) [rad/s^2]
    tau: Array  # (T, 8) of the robot's joints [Nm]
    pressure: Array  # (T,) centre of pressure of both feet, ahead of the stance ankle [m]
    double_support_s: float  # duration of load on the rear foot, finally on its toe
    desired: Array | None = None  # (T, 18) angles and rates of the links that a controller follows; None for q and qd


def make_simulation_model(step_motion: Callable[[NumericPoint], StepMotion]) -> SimulationModel:
    """Return the engine's model of a step."""

    def motion(point: NumericPoint) -> Signals:
        return make_signals(step_motion(point), measure_stair(point)[1])

    def ground(point: NumericPoint) -> tuple[Tread, ...]:
        tread, rise = measure_stair(point)
        return tuple(Tread(edge_m=k * tread - SETBACK, height_m=(k + 1) * rise) for k in range(2))

    return SimulationModel(robot=make_rigid_bodies(), gravity=biped.GRAVITY, motion=motion, ground=ground, planar=True)


def make_standing_step(
    t: Array, q: Array, qd: Array, qdd: Array, toe: Array, sole: Array, double_support_s: float
) -> StepMotion:
    """Return a step over the flat stance foot from angles q (T, 7) [rad] and forces (T, 2) [N] on rear toe and sole joint."""
    loads = biped.make_loads("T", "S").map(len(t))(q.T, qd.T, qdd.T, toe.T, sole.T)
    torque, stance, pressure = (np.array(values).T for values in loads)
    flat = np.zeros((len(t), len(biped.LINKS) - len(biped.MOVING)))
    q, qd, qdd = (np.hstack([values, flat]) for values in (q, qd, qdd))
    places = _locate_points(q)
    carried = stance[:, 1] * pressure[:, 0] + toe[:, 1] * places["T"][:, 0] + sole[:, 1] * places["S"][:, 0]
    whole = stance[:, 1] + toe[:, 1] + sole[:, 1]
    tau = compute_joint_torques(torque, _compute_stance_toe_torque(stance[:, 1], pressure[:, 0]))
    return StepMotion(t, q, qd, qdd, tau, carried / whole, double_support_s)


def compute_ground_force(q: Array, qd: Array, qdd: Array) -> Array:
    """Return the ground force (T, 2) on the whole robot [N] from the motion of the moving links (T, 7)."""
    nothing = np.zeros((2, len(q)))
    return np.array(biped.make_loads("T", "S").map(len(q))(q.T, qd.T, qdd.T, nothing, nothing)[1]).T


def make_driven_step(t: Array, state: Array, torque: Array, pressure: Array, double_support_s: float) -> StepMotion:
    """Return a step whose links were driven by torques (T, 9) against the world [Nm].

    No motor acts on a link against the world. Joints that give seven links their torques, and the standing toe, leave a
    moment on the stance foot, which the ground takes. The state (T, 18) has the links' angles and rates.
    """
    q, qd = np.split(state, 2, axis=1)
    between = torque[:, : len(biped.MOVING)] @ np.linalg.inv(biped.JOINT_RATES)
    tau = compute_joint_torques(between, torque[:, biped.LINKS.index("S'T'")])
    return StepMotion(t - t[0], q, qd, np.gradient(qd, t, axis=0), tau, pressure, double_support_s - t[0])


def make_signals(step: StepMotion, rise: float) -> Signals:
    """Return time histories of the robot's joints; the stance foot stands ``rise`` above the floor [m]."""
    places = _locate_points(step.q)
    lean = np.pi / 2 - step.q[:, biped.LINKS.index("UH")]  # from upright, forward
    still = np.zeros_like(lean)
    rear = (step.t <= step.double_support_s) | (step.t == step.t[-1])  # it lands at the end

    def lift(point: Array) -> Array:
        """Return points (T, 3) above the floor on which the rear foot stands."""
        return np.column_stack([point[:, 0], still, point[:, 1] + rise])

    arrays = {
        "t": step.t,
        "q": step.q @ FROM_LINKS - ZERO_POSE,
        "qd": step.qd @ FROM_LINKS,
        "qdd": step.qdd @ FROM_LINKS,
        "tau": step.tau,
        "zmp": np.column_stack([step.pressure, still]),
        "hip": lift(places["H"]),
        "attitude": np.column_stack([np.cos(lean / 2), still, np.sin(lean / 2), still]),
        "left_foot": lift(places["A'"]),
        "right_foot": lift(places["A"]),
        "left_bears": np.ones((len(step.t), 1)),
        "right_bears": rear[:, None].astype(float),
    }
    if step.desired is not None:
        q, qd = np.split(step.desired, 2, axis=1)
        arrays |= {"q_desired": q @ FROM_LINKS - ZERO_POSE, "qd_desired": qd @ FROM_LINKS}
    followed = {"q_desired": Columns(unit="rad", labels=JOINTS), "qd_desired": Columns(unit="rad/s", labels=JOINTS)}
    return Signals(joints=JOINTS, arrays=arrays, columns=SIMULATED | followed)


def _compute_stance_toe_torque(load: Array, pressure: Array) -> Array:
    """(T,) torque of the standing toe from the foot's load [N] and its centre from the ankle [m]; none behind the joint."""
    paper = biped.load_toe_foot_biped()
    weight = paper.link("ST").mass_kg * biped.GRAVITY * paper.toe_m / 2
    return np.maximum(load * (pressure - paper.sole_m) - weight, 0.0)


def measure_stair(point: NumericPoint | Mapping[str, float]) -> tuple[float, float]:
    """Tread and rise [m]."""
    tread = float(point["stair_length_m"]) / 2
    return tread, tread * float(point["rise_run_ratio"])


def _locate_points(q: Array, stance_ankle: Array | None = None) -> dict[str, Array]:
    """Return the places (T, 2) of joints and ends by name [m], for angles (T, 9); the stance ankle is by default at zero."""
    angles, ankle = SX.sym("q", len(biped.LINKS)), SX.sym("ankle", 2)
    points = biped.locate_points(angles, ankle)
    base = np.zeros((len(q), 2)) if stance_ankle is None else stance_ankle
    places = ca.Function("points", [angles, ankle], list(points.values())).map(len(q))(q.T, base.T)
    return {name: np.array(place.full().T) for name, place in zip(points, places, strict=True)}
