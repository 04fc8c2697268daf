"""The 12-joint biped for the engine, as rigid bodies, and for drawings, as a stick figure.

An engine cannot simulate point masses on links without mass: a joint between two such links has no inertia. The rigid bodies keep
every mass in its place, as a small sphere, and divide it among the links that meet there. Only a part of the foot's mass cannot
stay on the shank: it belongs to the sole and the ankle, at the same height above the ankle.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, NumericPoint, Signals, SimulationModel, display
from nlp_gait.gaits.walk12.walk12_model import GRAVITY, PointMassBiped, Zmp
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps_at
from nlp_gait.robots import Foot, Link, Robot
from nlp_gait.robots.robot import Vector, make_free_joint
from nlp_gait.robots.tree import compute_point_inertia, list_moments, make_tree
from nlp_gait.symbolic.dynamics import newton_euler

SPHERE_RADIUS = 0.02  # of a mass [m]: half the width of NAO's limbs
SOLE_SHARE = 0.1  # of the foot's mass that belongs to the sole; the ankle has the same share
# Of its drives the paper prints a holding torque of 1.02 Nm, but no stiffness. Here the largest torque of each is the robot's
# weight times the length of what the joint moves: leg, shank, front of the foot. NAO's motors have 0.8 to 1.6 times that at stall
# (hip pitch; knee and ankle).
FINE_INTERVALS = 1000  # of a step
BEARINGS = {  # joints by side: hip yaw, roll, pitch, knee, ankle pitch, ankle roll; pitches lean back (eqs. 2, 3)
    "left": ("theta_4", "theta_6", "theta_5", "theta_3", "theta_2", "theta_1"),
    "right": ("theta_9", "theta_7", "theta_8", "theta_10", "theta_11", "theta_12"),
}
Flags = np.ndarray[Any, np.dtype[np.bool_]]


def make_simulation_model(robot: PointMassBiped, zmp: Zmp) -> SimulationModel:
    """Return the biped's steps for the engine."""
    bodies = make_rigid_bodies(robot)

    def motion(at: NumericPoint, steps: int) -> Signals:
        walked = compute_steps_at(at, robot, intervals=FINE_INTERVALS, zmp=zmp, steps=steps).arrays
        left, heading = _follow_steps(walked, float(at["turn_rad"]))
        still = np.zeros_like(heading)
        given = [walked[name].T for name in ("q", "qd", "qdd")]
        dynamics = (_make_inverse_dynamics(bodies, side).map(len(left)) for side in ("left", "right"))
        torques = [np.array(function(*given)).T for function in dynamics]
        arrays = {
            **{name: walked[name] for name in ("t", "q", "qd", "qdd", "zmp")},
            "tau": np.where(left[:, None], *torques),  # with the stance foot still and the other foot free
            "hip": walked["waist"],
            "attitude": np.column_stack([np.cos(heading / 2), still, still, np.sin(heading / 2)]),
            "left_foot": walked["left_ankle"],
            "right_foot": walked["right_ankle"],
        }
        return Signals(joints=JOINTS, arrays=arrays, columns=display.SIMULATED)

    return SimulationModel(robot=bodies, gravity=GRAVITY, repeats=True, motion=motion)


@cache
def make_rigid_bodies(robot: PointMassBiped) -> Robot:
    """Return links with small spheres as masses; the root is the waist, between the hips, and the ankles are on the ground."""
    hip, knee, foot = robot.hip_mass_kg, robot.knee_mass_kg, robot.foot_mass_kg
    here: Vector = (0, 0, 0)
    thigh_end, shank_end, up = -robot.thigh_m, -robot.shank_m, robot.foot_com_height_m
    across = robot.hip_distance_m / 2
    weight = GRAVITY * (2 * (knee + foot + hip) + robot.waist_mass_kg)
    # By link: masses with their places in its axes. The three links at a hip share its mass, the two at a knee share the knee's.
    contents: dict[str, list[tuple[float, Vector]]] = {
        "waist": [(robot.waist_mass_kg, here), (hip / 3, (0, across, 0)), (hip / 3, (0, -across, 0))]
    }
    joints, feet = {}, {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        # Links from the hip down: axis and place of the joint, length of what it moves, masses.
        on_shank = (1 - 2 * SOLE_SHARE) * foot, (0, 0, shank_end + up)
        leg: dict[str, tuple[Vector, Vector, float, list[tuple[float, Vector]]]] = {
            "yaw": ((0, 0, 1), (0, sign * across, 0), robot.leg_m, [(hip / 3, here)]),
            "roll": ((1, 0, 0), here, robot.leg_m, [(hip / 3, here)]),
            "thigh": ((0, -1, 0), here, robot.leg_m, [(knee / 2, (0, 0, thigh_end))]),
            "shank": ((0, 1, 0), (0, 0, thigh_end), robot.shank_m, [(knee / 2, here), on_shank]),
            "ankle": ((0, -1, 0), (0, 0, shank_end), robot.foot_front_m, [(SOLE_SHARE * foot, (0, 0, up))]),
            "foot": ((1, 0, 0), here, robot.foot_front_m, [(SOLE_SHARE * foot, (0, 0, up))]),
        }
        parent = "waist"
        for name, (part, (axis, origin, moved, masses)) in zip(BEARINGS[side], leg.items(), strict=True):
            link = f"{side} {part}"
            contents[link] = masses
            joints[name] = make_free_joint(name, parent, link, origin, axis, weight * moved)
            parent = link
        feet[side] = Foot(
            link=f"{side} foot",
            ankle_height_m=0.0,
            front_m=robot.foot_front_m,
            back_m=robot.foot_back_m,
            left_m=robot.foot_width_m / 2,
            right_m=robot.foot_width_m / 2,
        )
    return Robot(
        name=robot.name,
        description=robot.description,
        sources={"masses and lengths": robot.source},
        root="waist",
        links={name: _make_link(name, held) for name, held in contents.items()},
        joints={name: joints[name] for name in JOINTS},
        feet=feet,
    )


def _make_link(name: str, held: Sequence[tuple[float, Vector]]) -> Link:
    masses, places = np.array([mass for mass, _ in held]), np.array([place for _, place in held], dtype=float)
    total = float(masses.sum())
    com = masses @ places / total
    tensor = 0.4 * total * SPHERE_RADIUS**2 * np.eye(3)
    for mass, place in zip(masses.tolist(), places, strict=True):
        tensor += compute_point_inertia(mass, place - com)
    x, y, z = com.tolist()
    return Link(name=name, mass_kg=total, com_m=(x, y, z), inertia_com_kgm2=list_moments(tensor))


def _follow_steps(walked: Mapping[str, Array], turn: float) -> tuple[Flags, Array]:
    """Return (T,) whether the left leg stands, and (T,) the heading [rad], which turns with each exchange of the legs."""
    left = walked["left_stance"] > 0.5
    return left, np.concatenate([[0], np.cumsum(np.diff(left) != 0)]) * turn


@cache
def _make_inverse_dynamics(bodies: Robot, side: str) -> ca.Function:
    motion = [SX.sym(name, len(JOINTS)) for name in ("q", "qd", "qdd")]
    q, qd, qdd = (dict(zip(JOINTS, ca.vertsplit(part), strict=True)) for part in motion)
    torques, _ = newton_euler(make_tree(bodies, bodies.feet[side].link), q, qd, qdd, GRAVITY)
    return ca.Function("torques", motion, [ca.cse(ca.vertcat(*(torques[name] for name in JOINTS)))])


def make_skeleton(robot: PointMassBiped, signals: Signals, parameters: Mapping[str, float]) -> display.Skeleton:
    """Return the stick figure of a motion; the robot turns to the left by ``turn_rad`` after each step."""
    arrays = signals.arrays
    waist, (left_stands, heading) = arrays["waist"], _follow_steps(arrays, parameters["turn_rad"])
    forward = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=1)
    outline = display.make_rectangle(
        -robot.foot_back_m, robot.foot_front_m, -robot.foot_width_m / 2, robot.foot_width_m / 2
    )
    limbs, soles = [], []
    for side, sign, stands in ((display.LEFT, 0.5, left_stands), (display.RIGHT, -0.5, ~left_stands)):
        hip, ankle = waist + sign * robot.hip_distance_m * across, arrays[f"{side}_ankle"]
        knee = _place_knee(hip, ankle, forward, robot.thigh_m, robot.shank_m)
        limbs.append(display.Limb(side=side, points=np.stack([waist, hip, knee, ankle], axis=1)))
        corners = ankle[:, None, :] + outline[:, :1] * forward[:, None, :] + outline[:, 1:2] * across[:, None, :]
        soles.append(display.Sole(side=side, corners=corners, supports=stands))
    return display.make_flat_skeleton(signals, limbs, soles)


def _place_knee(hip: Array, ankle: Array, forward: Array, thigh: float, shank: float) -> Array:
    """Return the knee (T, 3), bent forward in the plane of the leg and the forward axis [m]; a leg out of reach is straight."""
    leg = ankle - hip
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    along = leg / length
    down = (thigh**2 - shank**2 + length**2) / (2 * length)
    ahead = forward - (forward * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.asarray(hip + down * along + np.sqrt(np.maximum(thigh**2 - down**2, 0.0)) * ahead)
