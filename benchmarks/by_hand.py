"""NAO's single support as one would write it with NumPy and Pinocchio: the yardstick of the benchmarks.

Samples are vectorised with NumPy, torques come from ``pin.rnea`` sample by sample, rates from ``np.gradient`` as in the paper.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

import nlp_gait
from benchmarks.rows import Array
from nlp_gait.gaits.nao.body import GRAVITY, HELD_ARM_ANGLES, JOINTS, PLANNED_JOINTS, make_nao
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import TreeBody, make_tree

# Gupta, Pratihar, Deb (2023), section 4.1 and Table 3 [m, rad].
SUPPORT_XY, SWING_X, SWING_Y = (0.06, 0.05), (0.0, 0.12), -0.05
HIP_X, HIP_Y, MEAN_DBM = (0.03, 0.09), 0.025, (0.05, 0.02)
ARM_SWING = {
    "LShoulderPitch": (2.0, 1.0),
    "LElbowRoll": (-0.42, -0.64),
    "RShoulderPitch": (1.0, 2.0),
    "RElbowRoll": (0.64, 0.42),
}


def pinocchio_model(robot: Robot) -> tuple[pin.Model, list[int]]:
    """Robot on its left foot, and for each of JOINTS its place among the model's coordinates."""
    model, indexes = pin.Model(), {0: 0}
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    tree = make_tree(robot, robot.feet["left"].link)
    for i, body in enumerate(tree[1:], start=1):
        axis = body.direction * np.array(body.joint.axis)
        placement = pin.SE3(np.eye(3), np.array(body.offset_m))
        joint = model.addJoint(indexes[body.parent], pin.JointModelRevoluteUnaligned(axis), placement, body.joint.name)
        model.appendBodyToJoint(joint, _inertia(body), pin.SE3.Identity())
        indexes[i] = joint
    return model, [model.joints[model.getJointId(name)].idx_q for name in JOINTS]


def _inertia(body: TreeBody) -> pin.Inertia:
    return pin.Inertia(body.link.mass_kg, np.array(body.com_offset_m), body.link.inertia_matrix)


class ByHand:
    """Objective and violation, candidate by candidate.

    Attributes:
        problem: the package's problem that it equals, for comparison; names, lower and upper are its.
    """

    def __init__(self) -> None:
        self.problem = nlp_gait.load("nao-ssp", derivatives="finite-difference")
        self.names, self.lower, self.upper = self.problem.names, self.problem.lower, self.problem.upper
        self.robot = make_nao("nao-v5").robot
        self.model, self.places = pinocchio_model(self.robot)
        self.data = self.model.createData()
        self.phase = np.linspace(0.0, 1.0, 11)
        self.foot = self.robot.feet["left"]
        self.foot_body = make_tree(self.robot, self.foot.link)[0]
        limits = [self.robot.joint(name).planning_limits_rad for name in JOINTS]
        self.joint_lower, self.joint_upper = np.array(limits).T[:, :, None]
        self.legs = [JOINTS.index(name) for name in PLANNED_JOINTS]

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """(P,) objectives and (P,) violations of candidates (P, 9)."""
        return tuple(np.array(values) for values in zip(*map(self.one, X), strict=True))

    def one(self, x: Array) -> tuple[float, float]:
        """Objective and violation of one candidate."""
        duration = x[8]
        q, reach = self.angles(x)
        qd = np.gradient(q, duration / 10, axis=1)
        qdd = np.gradient(qd, duration / 10, axis=1)
        torque, zmp = self.loads(q, qd, qdd)
        power = np.abs(torque * qd).sum(axis=0) + 0.025 * (torque**2).sum(axis=0)
        objective = np.trapezoid(power, dx=0.1)
        along, across = zmp[0], zmp[1]
        dbm_x = np.where(along < 0.0, along + self.foot.back_m, self.foot.front_m - along)
        dbm_y = np.minimum(self.foot.left_m - across, across + self.foot.right_m)
        legs = q[self.legs]
        lower, upper = self.joint_lower[self.legs], self.joint_upper[self.legs]
        excess = [np.maximum(np.maximum(lower - legs, legs - upper), 0.0).sum()]
        excess.append(np.maximum(np.abs(reach) - 0.99, 0.0).sum())
        excess.append(np.maximum(np.abs(np.diff(torque, axis=1)) - 1.2, 0.0).sum())
        for margin, mean in zip((dbm_x, dbm_y), MEAN_DBM, strict=True):
            excess.append(np.maximum(-margin, 0.0).sum() / 0.01 + max(mean - margin.mean(), 0.0) / 0.01)
        outside = np.maximum(np.maximum(self.problem.lower - x, x - self.problem.upper), 0.0)
        return float(objective), float(sum(excess) + (outside / self.problem.scale).sum())

    def angles(self, x: Array) -> tuple[Array, Array]:
        """(22, 11) joint angles, rows as JOINTS, and (2, 11) cosines of the knees."""
        height, vz0, vz1, vx0, vx1, vy0, vy1, lift, duration = x
        still = np.full_like(self.phase, 1.0)
        hip = np.array(
            [
                self.cubic(*HIP_X, vx0 * duration, vx1 * duration),
                self.cubic(HIP_Y, HIP_Y, vy0 * duration, vy1 * duration),
                self.cubic(height, height, vz0 * duration, vz1 * duration),
            ]
        )
        ankle = self.foot.ankle_height_m
        forward = self.cubic(*SWING_X, 0.0, 0.0)
        rise = lift * (1.0 - ((forward - sum(SWING_X) / 2) / ((SWING_X[1] - SWING_X[0]) / 2)) ** 2)
        feet = {
            "L": np.array([SUPPORT_XY[0] * still, SUPPORT_XY[1] * still, ankle * still]),
            "R": np.array([forward, SWING_Y * still, ankle + rise]),
        }
        values = {name: angle * still for name, angle in HELD_ARM_ANGLES.items()}
        values |= {name: self.cubic(a, b, 0.0, 0.0) for name, (a, b) in ARM_SWING.items()}
        reach = []
        for side, foot in feet.items():
            joint = np.array(self.robot.joint(f"{side}HipYawPitch").origin_m)[:, None]
            thigh, tibia = (-self.robot.joint(f"{side}{name}Pitch").origin_m[2] for name in ("Knee", "Ankle"))
            along, across, up = foot - hip - joint
            length = np.sqrt(across**2 + up**2)
            cosine = (along**2 + length**2 - thigh**2 - tibia**2) / (2 * thigh * tibia)
            roll, knee = np.arctan2(across, -up), np.arccos(np.clip(cosine, -1.0, 1.0))
            pitch = np.arctan2(-along, length) - np.arctan2(tibia * np.sin(knee), thigh + tibia * np.cos(knee))
            names = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
            angles = (0.0 * still, roll, pitch, knee, -(pitch + knee), -roll)
            values |= {f"{side}{name}": angle for name, angle in zip(names, angles, strict=True)}
            reach.append(cosine)
        return np.array([values[name] for name in JOINTS]), np.array(reach)

    def cubic(self, start: float, end: float, rate0: float, rate1: float) -> Array:
        """Cubic through end positions and end rates per phase."""
        s = self.phase
        c2, c3 = 3 * (end - start) - 2 * rate0 - rate1, rate0 + rate1 - 2 * (end - start)
        return start + s * (rate0 + s * (c2 + s * c3))

    def loads(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Torques (22, 11) and the ZMP (2, 11) relative to the support ankle."""
        samples = q.shape[1]
        states = np.empty((3, samples, self.model.nq))
        states[:, :, self.places] = q.T, qd.T, qdd.T
        torques, wrenches = np.empty((samples, self.model.nv)), np.empty((samples, 6))
        for k in range(samples):
            torques[k] = pin.rnea(self.model, self.data, *states[:, k])
            # On all but the foot, about the ankle; the ankle's roll turns the moving axes.
            wrenches[k] = self.data.liMi[1].act(self.data.f[1]).vector
        foot = self.foot_body.link.mass_kg * GRAVITY
        fx, fy, fz, mx, my, _ = wrenches.T
        x, y, _ = self.foot_body.com_offset_m
        mx, my, fz = mx + y * foot, my - x * foot, fz + foot
        height = self.foot.ankle_height_m
        return torques.T[self.places], np.array([-(my + height * fx), mx - height * fy]) / fz
