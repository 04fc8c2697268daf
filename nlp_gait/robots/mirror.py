"""Left and right of a robot: which joint is the image of which, and whether both turn the same way in mirrored motions."""

from __future__ import annotations

from nlp_gait.robots.robot import Robot


def partner(name: str) -> str:
    """Joint on the other side, for example LKneePitch for RKneePitch; a joint of neither side is its own image."""
    swapped = {"L": "R", "R": "L"}.get(name[0])
    return swapped + name[1:] if swapped and name[1:2].isupper() else name


def mirror_sign(robot: Robot, joint: str) -> float:
    """+1 if a joint and its partner turn the same way in motions mirrored left to right, -1 if in opposite ways.

    A reflection at the plane y = 0 turns an axis (x, y, z) of rotation into (-x, y, -z).

    Raises:
        UnknownNameError: the robot lacks the joint or its partner.
    """
    (x, y, z), other = robot.joint(joint).axis, robot.joint(partner(joint)).axis
    return 1.0 if -x * other[0] + y * other[1] - z * other[2] > 0.0 else -1.0
