"""A robot's image in the plane between left and right."""

from dataclasses import replace

from nlp_gait.robots import Foot, Joint, Link, Robot, load_robot

LINK_NAMES = {"l_ankle": "r_ankle", "l_wrist": "r_wrist", "r_ankle": "l_ankle", "r_wrist": "l_wrist"}


def partner(name: str) -> str:
    """Name on the other side: LKneePitch and RKneePitch."""
    swapped = {"L": "R", "R": "L"}.get(name[0])
    return swapped + name[1:] if swapped and name[1].isupper() else name


def other_link(name: str) -> str:
    return LINK_NAMES.get(name, partner(name))


def axis_image(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """Image of an axis of rotation: what is reflected turns the other way."""
    return -axis[0], axis[1], -axis[2]


def _joint_signs() -> dict[str, float]:
    """+1 where a joint and its partner turn alike in mirrored motions, -1 where they turn against each other."""
    joints = load_robot("nao-v5").joints
    images = {name: axis_image(joint.axis) for name, joint in joints.items()}
    return {
        name: 1.0 if sum(a * b for a, b in zip(image, joints[partner(name)].axis, strict=True)) > 0.0 else -1.0
        for name, image in images.items()
    }


JOINT_SIGNS = _joint_signs()


def mirrored(robot: Robot) -> Robot:
    """The image, with names and positive senses of joints as the robot has them."""
    links = (link_image(robot.links[other_link(name)], name) for name in robot.links)
    joints = (joint_image(robot.joints[partner(name)], joint) for name, joint in robot.joints.items())
    left, right = (foot_image(robot.feet[side]) for side in ("right", "left"))
    return replace(
        robot,
        links={link.name: link for link in links},
        joints={joint.name: joint for joint in joints},
        feet={"left": left, "right": right},
    )


def link_image(link: Link, name: str) -> Link:
    x, y, z = link.com_m
    ixx, iyy, izz, ixy, ixz, iyz = link.inertia_com_kgm2
    return replace(link, name=name, com_m=(x, -y, z), inertia_com_kgm2=(ixx, iyy, izz, -ixy, ixz, -iyz))


def joint_image(other: Joint, own: Joint) -> Joint:
    x, y, z = other.origin_m
    sign = JOINT_SIGNS[own.name]
    ax, ay, az = axis_image(other.axis)
    return replace(own, origin_m=(x, -y, z), axis=(sign * ax, sign * ay, sign * az))


def foot_image(foot: Foot) -> Foot:
    polygon = tuple((x, -y) for x, y in foot.sole_polygon_m)
    return replace(foot, link=other_link(foot.link), left_m=foot.right_m, right_m=foot.left_m, sole_polygon_m=polygon)
