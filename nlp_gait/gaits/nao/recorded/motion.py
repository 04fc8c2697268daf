"""Joint angles of NAO over time, made by anybody, as a motion on the left foot."""

from __future__ import annotations

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.formulation.motion.signals import JointAngles
from nlp_gait.gaits.biped.recorded.motion import FINE, LEAST_ROWS, LIFTED, Motion
from nlp_gait.gaits.biped.recorded.stance import Stance
from nlp_gait.gaits.nao.body import HELD_ARM_ANGLES, JOINTS
from nlp_gait.gaits.nao.legs import leg_geometry
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import partner

# Joints of the arms that a file may leave out: they are held as in the paper, section 3.1 and in the middle of Table 3.
LEFT_OUT = HELD_ARM_ANGLES | {"LShoulderPitch": 1.5, "RShoulderPitch": 1.5, "LElbowRoll": -0.53, "RElbowRoll": 0.53}


def of_all_joints(angles: JointAngles) -> Array:
    """(T, 22) columns as ``JOINTS``; joints of the arms that are missing are held [rad]."""
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    return np.column_stack([columns.get(name, np.full(len(angles.t), LEFT_OUT.get(name, 0.0))) for name in JOINTS])


def stance_of(robot: Robot) -> Stance:
    """NAO, as ``gaits.nao.body.nao`` makes it, on its left foot below its own hip joint."""
    geometry = leg_geometry(robot, "L")
    return Stance(
        robot=robot,
        joints=JOINTS,
        images=tuple(map(partner, JOINTS)),
        support=(0.0, geometry.hip_m[1], geometry.ankle_height_m),
    )


def motion_of(angles: JointAngles, robot: Robot) -> Motion:
    """Motion of a robot on its left foot; mirrored if the right one is that which stands.

    Args:
        angles: of the legs, and of the arms as far as they are known.
        robot: as ``gaits.nao.body.nao`` makes it.

    Raises:
        InputError: a joint of the legs is missing, or times and angles are none.
    """
    missing = [name for name in JOINTS if name not in angles.joints]
    needed = [name for name in missing if name not in LEFT_OUT]
    if needed:
        raise InputError(f"{angles.owner} has no angles of {', '.join(needed)}")
    if len(angles.t) < LEAST_ROWS:
        raise InputError(f"{angles.owner} has {len(angles.t)} rows; a motion needs {LEAST_ROWS}")
    if not (np.isfinite(angles.t).all() and np.diff(angles.t).min() > 0.0):
        raise InputError(f"{angles.owner}: times must ascend")
    columns = dict(zip(angles.joints, angles.q.T, strict=True))
    for name in JOINTS:
        if name in columns and not np.isfinite(columns[name]).all():
            raise InputError(f"{angles.owner}: an angle of {name} is missing")
    motion = Motion(stance=stance_of(robot), t=angles.t - angles.t[0], q=of_all_joints(angles), held=tuple(missing))
    heights = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))[:, 2]
    return motion.mirror_image() if -heights.min() > max(heights.max(), LIFTED) else motion
