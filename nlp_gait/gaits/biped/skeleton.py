"""Stick figure of any biped: legs, soles, and every other limb that is long enough to be seen."""

from collections.abc import Mapping

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.display import LEFT, RIGHT, TRUNK, Limb, Skeleton, Sole, make_flat_skeleton, make_rectangle
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics, turn_about_vertical

ON_GROUND = 1e-6  # [m]; a higher sole does not bear load
SHORTEST_SHARE = 0.25  # of the height of the root at zero angles; shorter limbs are fingers and cameras


def draw_robot(robot: Robot, signals: Signals) -> Skeleton:
    """Return a robot's limbs and soles over time; joints that a gait does not move are at zero."""
    arrays = signals.arrays
    feet = {f"{side}_foot": arrays[f"{side}_foot"] for side in (LEFT, RIGHT)}
    places = locate_links(robot, signals) | feet
    limbs = [
        Limb(side=side, points=np.stack([places[name] for name in names], axis=1)) for side, names in list_limbs(robot)
    ]
    yaw = arrays["feet_yaw"].T if "feet_yaw" in arrays else (None, None)
    soles = [make_level_sole(robot, side, feet[f"{side}_foot"], yaw[k]) for k, side in enumerate((LEFT, RIGHT))]
    return make_flat_skeleton(signals, limbs, soles)


def list_limbs(robot: Robot) -> list[tuple[str, list[str]]]:
    """Return side and points of each line: names of ``place_links``, and ``left_foot`` and ``right_foot``, under the ankles."""
    chains = {side: _list_chain(robot, robot.feet[side].link) for side in (LEFT, RIGHT)}
    limbs = [(side, [*chain, f"{side}_foot"]) for side, chain in chains.items()]
    legs = {joint.child for side in (LEFT, RIGHT) for joint in robot.path_to_root(robot.feet[side].link)}
    height = -min(float(_place_at_zero(robot, foot.link)[2]) for foot in robot.feet.values())
    parents = {joint.parent for joint in robot.joints.values()}
    for end in (link for link in robot.links if link not in parents):
        chain, place = _list_chain(robot, end), _place_at_zero(robot, end)
        if not legs & {end, *chain[1:]} and np.linalg.norm(place) >= SHORTEST_SHARE * height:
            side = TRUNK if abs(place[1]) < 0.1 * height else LEFT if place[1] > 0 else RIGHT
            sideways = next((k for k, name in enumerate(chain[1:], 1) if robot.joint_to[name].origin_m[1]), 0)
            if sideways:  # an arm, which begins in the middle of the trunk
                middle = f"between {chain[sideways]}"
                limbs.append((TRUNK, [*chain[:sideways], middle]))
                chain = [middle, *chain[sideways:]]
            limbs.append((side, [*chain, f"{end} tip"]))
    return limbs


def make_level_sole(robot: Robot, side: str, centre: Array, yaw: Array | None = None) -> Sole:
    """Return the sole of a foot that stays level, from the point under its ankle (T, 3) [m] and its yaw (T,) [rad]."""
    foot = robot.feet[side]
    outline = make_rectangle(-foot.back_m, foot.front_m, -foot.right_m, foot.left_m)
    if yaw is not None:
        outline = turn_about_vertical(outline, yaw[:, None])
    return Sole(side=side, corners=centre[:, None, :] + outline, supports=centre[:, 2] <= ON_GROUND)


def _list_chain(robot: Robot, link: str) -> list[str]:
    """Return the links from the root to a link; of joints in one place, the first one's."""
    return [robot.root, *(joint.child for joint in reversed(robot.path_to_root(link)) if any(joint.origin_m))]


def _place_at_zero(robot: Robot, link: str) -> Array:
    """Position (3,) of a link's joint from the root at zero angles [m]."""
    return np.sum([(0.0, 0.0, 0.0), *(joint.origin_m for joint in robot.path_to_root(link))], axis=0)


def place_links(robot: Robot, angles: Mapping[str, SX], left_ankle: SX) -> dict[str, SX]:
    """Return places (3,) from the left ankle [m], other joints at zero.

    They are every link's joint, its tip, which is its centre of mass, and the point of its parent's sagittal plane beside it.
    """
    tree = make_tree(robot, robot.feet[LEFT].link)
    places: dict[str, SX] = {}
    poses = forward_kinematics(tree, dict.fromkeys(robot.joints, SX(0)) | dict(angles), left_ankle)
    for body, pose in zip(tree, poses, strict=True):
        # A body's reference point is the joint by which it is reached; its own joint is elsewhere where that leads up.
        joint = robot.joint_to.get(body.link.name)
        upwards = body.joint is not None and body.direction < 0
        offset = np.array(body.com_offset_m) - np.array(body.link.com_m) if upwards or joint is None else np.zeros(3)
        places[body.link.name] = pose.position + pose.rotation @ ca.DM(offset)
        places[f"{body.link.name} tip"] = pose.com
        for child in (joint for joint in robot.joints.values() if joint.parent == body.link.name):
            forward, _, up = child.origin_m
            middle = ca.DM([forward, 0.0, up])
            places[f"between {child.child}"] = places[body.link.name] + pose.rotation @ middle
    return places


def locate_links(robot: Robot, signals: Signals) -> dict[str, Array]:
    """Return the positions (T, 3) of ``place_links`` over time."""
    q, base = SX.sym("q", len(signals.joints)), SX.sym("base", 3)
    places = place_links(robot, dict(zip(signals.joints, ca.vertsplit(q), strict=True)), base)
    function = ca.Function("places", [q, base], list(places.values()))
    standing = signals.arrays["left_foot"] + np.array([0.0, 0.0, robot.feet[LEFT].ankle_height_m])
    values = function.map(len(signals.arrays["t"]))(signals.arrays["q"].T, standing.T)
    positions = {name: np.array(value.full().T) for name, value in zip(places, values, strict=True)}
    if "feet_yaw" not in signals.arrays:
        return positions
    yaw = signals.arrays["feet_yaw"][:, 0]
    return {name: standing + turn_about_vertical(place - standing, yaw) for name, place in positions.items()}
