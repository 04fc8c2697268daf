"""Loads of a motion: torques of all joints, and the ZMP and the ground's wrenches, by chains of links from the standing feet."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

from casadi import SX

from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.samples import BOTH_FEET, Instant, Loader
from nlp_gait.robots.tree import make_point_masses, make_tree
from nlp_gait.symbolic.dynamics import Wrench, combine_zmps, ground_load, newton_euler, shift_down, zmp_of_wrench
from nlp_gait.symbolic.kinematics import UP, axis_rotation
from nlp_gait.symbolic.trajectories import Motion

Division = Literal["printed", "lever"]


class Chain(NamedTuple):
    """Joints above a link that stands."""

    fixed_link: str
    joints: Sequence[str]
    shares: Mapping[str, SX] | None = None  # of the masses of some links that it carries


def compute_torques(body: Body, chain: Chain, motions: Mapping[str, Motion]) -> tuple[dict[str, SX], Wrench]:
    """Return the torques of a chain's joints, and the wrench on its fixed link; see ``newton_euler``."""
    q, qd, qdd = ({name: motion[order] for name, motion in motions.items()} for order in range(3))

    def solve(link: str, names: Sequence[str], shares: Mapping[str, SX] | None) -> tuple[dict[str, SX], Wrench]:
        tree = make_tree(body.robot, link, names)
        return newton_euler(tree, q, qd, qdd, body.gravity_vector, shares, body.upright)

    fixed_link, joints, shares = chain
    torques, wrench = solve(*chain)
    arms = [name for name in joints if name in body.separate_joints]
    legs = [name for name in joints if name not in arms]
    if not arms:
        return torques, wrench
    if shares and body.carries_shared_arms:
        (share,) = shares.values()
        carried = {body.robot.joint(name).child: share for name in body.separate_joints}
        torques = solve(fixed_link, (*legs, *body.separate_joints), {**shares, **carried})[0]
    else:
        torques = solve(fixed_link, legs, shares)[0]
    return {name: torques[name] for name in legs} | solve(body.robot.root, arms, shares)[0], wrench


def find_zmp_wrench(body: Body, chain: Chain, motions: Mapping[str, Motion], wrench: Wrench) -> Wrench:
    """Return the wrench of the ZMP: by the printed sign of g, that of point masses whose accelerations are reversed.

    With z'' - g for z'' + g, both sums of (19) and (20) are those of a motion with -x'', -y'', -z'': the wrench at rest
    minus the inertial part. It has no term I omega.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (19), (20), with g = 9.8 m/s^2; the masses of double support, section 3.2.
    """
    if body.zmp_gravity == "physical" and body.zmp_masses == 25:
        return wrench
    robot = make_point_masses(body.robot)
    if body.zmp_masses == 23:
        torso = replace(robot.links[robot.root], com_m=body.full.links[robot.root].com_m)
        robot = replace(robot, links={**robot.links, robot.root: torso})
    masses = replace(body, robot=robot)
    moving = compute_torques(masses, chain, motions)[1]
    if body.zmp_gravity == "physical":
        return moving
    at_rest = {name: Motion(motion.position, SX(0), SX(0)) for name, motion in motions.items()}
    resting = compute_torques(masses, chain, at_rest)[1]
    return Wrench(2 * resting.force - moving.force, 2 * resting.moment - moving.moment)


def make_single_support_loads(body: Body) -> Loader:
    """Return a function of the torques from the left foot, which supports the robot, and of the ZMP under it."""
    foot = body.robot.feet["left"]
    chain = Chain(foot.link, tuple(body.robot.joints))

    def loads(now: Instant) -> Instant:
        torques, wrench = compute_torques(body, chain, now.joints)
        acting = find_zmp_wrench(body, chain, now.joints, wrench)
        offset = zmp_of_wrench(acting, foot.ankle_height_m, body.weight)
        wrenches = {"L": shift_down(wrench, foot.ankle_height_m), "R": SX(6, 1)}
        return now._replace(torques=torques, zmp=now.ankles["L"][:2] + offset, wrenches=wrenches)

    return loads


def share_torso(
    hip_y: SX, rule: Division, feet_y: tuple[float, float] | tuple[SX, SX] = (0.05, -0.05)
) -> dict[str, SX]:
    """Compute the share of the torso's mass that each leg carries from the hip's distances to the feet; both add up to 1.

    The hip's place and the feet's, by default NAO's, are across the walking direction [m]. Distances are signed, so that a hip
    outside the feet gives shares outside 0 and 1 and no kink. By the rule ``"printed"`` a share is proportional to the distance
    *from* that leg's own foot, as in the equations; by ``"lever"`` to the distance from the other foot, as the text says: the
    nearer foot carries more.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (28), (29).
    """
    from_left, from_right = feet_y[0] - hip_y, hip_y - feet_y[1]
    width = feet_y[0] - feet_y[1]
    left, right = from_left / width, from_right / width  # (eqs. 28, 29)
    return {"L": left, "R": right} if rule == "printed" else {"L": right, "R": left}


def make_divided_loads(body: Body, rule: Division) -> Loader:
    """Return a function of the torques of each half from its own foot, and the combined ZMP of both feet."""
    robot, weight = body.robot, body.weight

    def loads(now: Instant) -> Instant:
        shares = share_torso(now.hip[1], rule, body.feet_y)
        if now.yaw.shape[0]:  # across the mean of both feet's directions
            mean = axis_rotation(UP, -now.yaw / 2)
            hip_y, *feet_y = ((mean @ place)[1] for place in (now.hip, *now.ankles.values()))
            shares = share_torso(hip_y, rule, (feet_y[0], feet_y[1]))
        torques: dict[str, SX] = {}
        zmps, ground_loads, wrenches = [], [], {}
        for side, name in BOTH_FEET.items():
            foot = robot.feet[name]
            half = Chain(foot.link, body.leg_joints[side], {robot.root: shares[side]})
            of_half, wrench = compute_torques(body, half, now.joints)
            acting = find_zmp_wrench(body, half, now.joints, wrench)
            height = foot.ankle_height_m
            if side == "R" and now.yaw.shape[0]:  # from the axes of its foot
                wrench, acting = (
                    Wrench(*(axis_rotation(UP, now.yaw) @ vector for vector in w)) for w in (wrench, acting)
                )
            wrenches[side] = shift_down(wrench, height)
            torques |= of_half
            zmps.append(now.ankles[side][:2] + zmp_of_wrench(acting, height, weight))
            ground_loads.append(ground_load(acting, weight))
        return now._replace(torques=torques, zmp=combine_zmps(zmps, ground_loads), wrenches=wrenches)

    return loads
