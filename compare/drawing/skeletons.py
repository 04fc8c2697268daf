"""Skeletons of all problems: from a result's time histories to what is drawn."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
from casadi import SX

from compare.drawing.skeleton import LEFT, RIGHT, TRUNK, Limb, Skeleton, Sole, flat_ground
from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, Signals
from nlp_gait.problem.result import Result
from nlp_gait.problem.sampled import sampled
from nlp_gait.problems.stairs.formulas.loads import link_angles
from nlp_gait.problems.stairs.formulas.planar_biped import LINKS
from nlp_gait.problems.stairs.formulas.planar_biped import points as planar_points
from nlp_gait.problems.stairs.robot import load_biped as load_stair_climber
from nlp_gait.problems.stairs.stair import SETBACK
from nlp_gait.problems.walk12.robot import load_biped
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.kinematics import forward_kinematics

ON_GROUND = 1e-6  # [m]; a sole that is higher does not bear load
LETTER = {LEFT: "L", RIGHT: "R"}


def skeleton_of(result: Result, frames_per_s: float) -> Skeleton:
    """Skeleton of a gait at about the given number of samples a second.

    Raises:
        InputError: the problem has no motion to draw.
    """
    name = result.problem.name
    for prefix, build in _BUILDERS.items():
        if name.startswith(prefix):
            return build(result, sampled(result, 1.0 / frames_per_s))
    raise InputError(f"problem {name!r} has no skeleton to draw; those of {', '.join(_BUILDERS)} have")


def _nao(result: Result, signals: Signals) -> Skeleton:
    """Joint centres by forward kinematics from the torso."""
    robot = load_robot(str(result.problem.options["robot"]))
    arrays = signals.arrays
    at = _link_origins(robot, signals)
    torso, neck = at[robot.root], at["Neck"]
    shoulders = (at["LShoulder"] + at["RShoulder"]) / 2
    limbs = [Limb(side=TRUNK, points=np.stack([torso, shoulders, neck, at["Head tip"]], axis=1))]
    soles = []
    for side, letter in LETTER.items():
        foot = robot.feet[side]
        leg = [torso, *(at[f"{letter}{link}"] for link in ("Pelvis", "Tibia")), at[foot.link]]
        arm = [shoulders, *(at[f"{letter}{link}"] for link in ("Shoulder", "Elbow")), at[f"{letter.lower()}_wrist tip"]]
        sole_centre = arrays[f"{side}_foot"]
        limbs += [Limb(side=side, points=np.stack(part, axis=1)) for part in ([*leg, sole_centre], arm)]
        outline = _rectangle(-foot.back_m, foot.front_m, -foot.right_m, foot.left_m)
        lifted = sole_centre[:, 2]
        soles.append(Sole(side=side, corners=sole_centre[:, None, :] + outline, supports=lifted <= ON_GROUND))
    return Skeleton(
        title=result.problem.title,
        t=arrays["t"],
        limbs=tuple(limbs),
        soles=tuple(soles),
        ground=flat_ground(*(sole.corners for sole in soles)),
        com=arrays["com"],
        zmp=_grounded(arrays["zmp"]),
    )


def _link_origins(robot: Robot, signals: Signals) -> dict[str, Array]:
    """World positions (T, 3) of every link's joint, and of the tips of head and hands; head joints at zero."""
    q = SX.sym("q", len(signals.joints))
    hip = SX.sym("hip", 3)
    angles = {name: SX(0) for name in robot.joints} | {name: q[i] for i, name in enumerate(signals.joints)}
    tree = tree_from(robot, robot.root)
    poses = forward_kinematics(tree, angles, hip)
    named = {body.link.name: pose.position for body, pose in zip(tree, poses, strict=True)}
    named |= {f"{body.link.name} tip": pose.com for body, pose in zip(tree, poses, strict=True)}
    function = ca.Function("origins", [q, hip], list(named.values()))
    values = function.map(len(signals.arrays["t"]))(signals.arrays["q"].T, signals.arrays["hip"].T)
    return {name: np.array(value.full().T) for name, value in zip(named, values, strict=True)}


def _walk12(result: Result, signals: Signals) -> Skeleton:
    """Hips beside the waist, knees from the lengths of thigh and shank."""
    robot, arrays = load_biped(), signals.arrays
    waist, left_stands = arrays["waist"], arrays["left_stance"] > 0.5
    steps = np.concatenate([[0], np.cumsum(np.diff(left_stands.astype(int)) != 0)])
    heading = steps * result.problem.value("turn_rad")
    forward = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=1)
    outline = _rectangle(-robot.foot_back_m, robot.foot_front_m, -robot.foot_width_m / 2, robot.foot_width_m / 2)
    limbs, soles = [], []
    for side, sign, stands in ((LEFT, 0.5, left_stands), (RIGHT, -0.5, ~left_stands)):
        hip, ankle = waist + sign * robot.hip_distance_m * across, arrays[f"{side}_ankle"]
        knee = _knee(hip, ankle, forward, robot.thigh_m, robot.shank_m)
        limbs.append(Limb(side=side, points=np.stack([waist, hip, knee, ankle], axis=1)))
        corners = ankle[:, None, :] + outline[:, :1] * forward[:, None, :] + outline[:, 1:2] * across[:, None, :]
        soles.append(Sole(side=side, corners=corners, supports=stands))
    return Skeleton(
        title=result.problem.title,
        t=arrays["t"],
        limbs=tuple(limbs),
        soles=tuple(soles),
        ground=flat_ground(*(sole.corners for sole in soles)),
        com=arrays["com"],
        zmp=_grounded(arrays["zmp"]),
    )


def _knee(hip: Array, ankle: Array, forward: Array, thigh: float, shank: float) -> Array:
    """Knee (T, 3) bent forward in the plane of the leg and the forward axis [m]; a leg out of reach is drawn straight."""
    leg = ankle - hip
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    along = leg / length
    down = (thigh**2 - shank**2 + length**2) / (2 * length)
    ahead = forward - (forward * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.asarray(hip + down * along + np.sqrt(np.maximum(thigh**2 - down**2, 0.0)) * ahead)


def _stairs(result: Result, signals: Signals) -> Skeleton:
    """Planar rods from the flat stance foot; its ankle is the origin."""
    history = signals.arrays.get("link_q", signals.arrays["q"])  # absolute angles of the moving links, or of all
    q = SX.sym("q", history.shape[1])
    found = planar_points(load_stair_climber().rods, q if q.numel() == len(LINKS) else link_angles(q), SX(2, 1))
    function = ca.Function("points", [q], list(found.values()))
    samples = len(signals.arrays["t"])
    values = dict(zip(found, function.map(samples)(history.T), strict=True))
    at = {name: np.array(value.full().T) for name, value in values.items()}
    lines = {RIGHT: ("H", "K", "A", "S", "T"), LEFT: ("H", "K'", "A'", "S'", "T'"), TRUNK: ("H", "U")}
    tread = result.problem.value("stair_length_m") / 2
    rise = tread * result.problem.value("rise_run_ratio")
    edges = [
        (-1.6 * tread, -1),
        (-SETBACK, -1),
        (-SETBACK, 0),
        (tread - SETBACK, 0),
        (tread - SETBACK, 1),
        (1.8 * tread, 1),
    ]
    zmp = signals.arrays.get("zmp")
    return Skeleton(
        title=result.problem.title,
        t=signals.arrays["t"],
        limbs=tuple(
            Limb(side=side, points=np.stack([_sagittal(at[name]) for name in names], axis=1))
            for side, names in lines.items()
        ),
        soles=(),
        ground=np.array([(x, level * rise) for x, level in edges]),
        com=None,
        zmp=None if zmp is None else _sagittal(np.column_stack([zmp.reshape(samples, -1)[:, 0], np.zeros(samples)])),
        planar=True,
    )


def _sagittal(points: Array) -> Array:
    """(T, 3) from (T, 2) of x and z."""
    return np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]])


def _rectangle(back: float, front: float, right: float, left: float) -> Array:
    """(4, 3) corners at height zero."""
    return np.array([[front, left, 0.0], [back, left, 0.0], [back, right, 0.0], [front, right, 0.0]])


def _grounded(zmp: Array) -> Array:
    """(T, 3) from (T, 2)."""
    return np.column_stack([zmp, np.zeros(len(zmp))])


_BUILDERS: dict[str, Callable[[Result, Signals], Skeleton]] = {"nao-": _nao, "walk12": _walk12, "stairs-": _stairs}
