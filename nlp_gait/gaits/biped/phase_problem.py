"""The problem of a phase: its goal, its limits, its start points, and its robot as it is drawn and simulated."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import Array, GaitProblem, Point, Signals, SolverHints, Start
from nlp_gait.formulation.display import (
    LEFT,
    RIGHT,
    TRUNK,
    Display,
    Limb,
    SimulationModel,
    Skeleton,
    Sole,
    make_flat_skeleton,
    make_rectangle,
)
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.gaits.biped import limits
from nlp_gait.gaits.biped.body import Body, Support, make_usual_bounds
from nlp_gait.gaits.biped.limits import HEAT_LOSS
from nlp_gait.gaits.biped.loads import make_single_support_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Loader
from nlp_gait.gaits.biped.sequence import Sequence
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics, turn_about_vertical
from nlp_gait.symbolic.nonsmooth import Exact

DRAWS = 50  # of a start point, at most


def make_phase_limits(body: Body, balance: limits.BalanceMargins) -> tuple[limits.Limit, ...]:
    """Return the limits of every phase (sections 4.1 and 4.2) and of the drives."""
    size = body.torque_scale
    return (
        limits.JointLimits(body.robot, body.planned),
        limits.Reach(),
        *(() if body.closed_form else (limits.Closure(),)),
        limits.TorqueChange(size),
        *((limits.DriveLimits(body.robot, size),) if body.drive_limits else ()),
        balance,
    )


def make_phase(
    body: Body,
    kind: Support,
    balance: limits.BalanceMargins,
    loads: Loader | None,
    added_limits: tuple[limits.Limit, ...] = (),
    make: Callable[..., Phase] = Phase,
    **fields: Any,
) -> Phase:
    """Return a phase of a kind with the usual limits, others, and further fields; ``loads`` are those of double support."""
    return make(
        body=body,
        loads=make_single_support_loads(body) if loads is None or kind is Support.SINGLE else loads,
        limits=(*make_phase_limits(body, balance), *added_limits),
        standing=kind.standing,
        **fields,
    )


def make_phase_problem(name: str, title: str, phase: Phase, *, searchable: bool = True) -> GaitProblem:
    """Return the problem of one phase, whose name and title lack the robot's; not ``searchable``, it needs gradients."""
    start = phase.start
    if not phase.body.closed_form:
        start = make_start_within_reach(phase, (), lambda point: phase.sample(point, Exact()).knee_cosine, start)
    return make_gait_problem(phase, name, title, SolverHints(start=start, searchable=searchable))


def make_gait_problem(
    gait: Phase | Sequence, name: str, title: str, hints: SolverHints, **simulated: Any
) -> GaitProblem:
    """Return the problem of a phase or a sequence of phases, whose name and title lack the robot's.

    ``simulated`` are fields of the model for simulations that are not the robot's.
    """
    body = gait.body

    def draw(signals: Signals, parameters: Mapping[str, float]) -> Skeleton:
        return draw_robot(body.full, signals)

    rotors = {name: joint.armature_kgm2 for name, joint in body.robot.joints.items()}
    joints = {
        name: replace(joint, armature_kgm2=rotors.get(name, joint.armature_kgm2))
        for name, joint in body.simulated.joints.items()
    }
    model = SimulationModel(
        robot=replace(body.simulated, joints=joints),
        gravity=body.gravity,
        slope_rad=body.slope_rad,
        heat_loss=HEAT_LOSS.name,
        **simulated,
    )
    return GaitProblem(
        name=f"{body.family}-{name}",
        title=f"{body.title} {title}",
        variables=gait.decisions,
        own_parameters=gait.parameters,
        objective=gait.objective,
        assemble=gait.assemble,
        grid=gait.grid,
        rows_over_time=gait.rows_over_time() if body.closed_form else (),
        display=Display(
            motion=gait.signals,
            durations=gait.durations,
            robot=body.full,
            skeleton=draw,
            simulation_model=model,
        ),
        hints=hints,
    )


def make_start_within_reach(
    gait: Phase | Sequence, names_read: tuple[str, ...], reach: Callable[[Point], MX], start: Start | None
) -> Start:
    """Return start points at which all knees are within reach, or the nearest of some: beyond reach there is no slope back.

    Besides the margin on the reach, the motion reads the parameters ``names_read``; ``reach`` gives the cosines of the knees at a
    point. Start points to choose from are those of ``start``, or any, within both the bounds and the usual ones.
    """
    variables = [make_usual_bounds(gait.body, variable) for variable in gait.decisions]
    read = (limits.REACH_MARGIN, *names_read)
    names = [variable.name for variable in variables]

    @cache
    def farthest() -> ca.Function:
        x, p = MX.sym("x", len(names)), MX.sym("p", len(read))
        return ca.Function("farthest", [x, p], [ca.mmax(ca.fabs(reach(Point.of(x, p, names, read))))])

    def draw(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        within = dict(parameters)
        for variable in variables:
            bounds = f"{variable.name}.lower", f"{variable.name}.upper"
            low, high = max(within[bounds[0]], variable.lower), min(within[bounds[1]], variable.upper)
            if low <= high:
                within |= zip(bounds, (low, high), strict=True)
        return draw_uniform(names, within, rng) if start is None else start(within, rng)

    def choose(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        best, least = np.zeros(0), np.inf
        for _ in range(DRAWS):
            x = draw(parameters, rng)
            cosine = float(farthest()(x, [parameters[name] for name in read]))
            if cosine < least:
                best, least = x, cosine
            if least <= 1.0 - parameters[limits.REACH_MARGIN]:
                break
        return best

    return choose


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
