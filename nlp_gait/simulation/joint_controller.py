"""PD controller of the joints with equal gains, and compensation of gravity: (50) of Bhardwaj et al."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from nlp_gait.formulation import Array
from nlp_gait.simulation.engine import Addresses, check_range, load_mujoco
from nlp_gait.simulation.plan import SIDES, Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class JointController:
    """Torque = K_p (desired angle - angle) + K_d (desired rate - rate), and a share of gravity, within the torque limits.

    It acts on the angles between links. The paper's angles from the forward axis would need torques against the world.

    Source:
        Bhardwaj et al., eq. (50); as printed it does not compensate gravity.
    """

    kp: float  # K_p of all joints [Nm/rad]
    kd: float  # K_d of all joints [Nm s/rad]
    gravity_compensation: float = 0.0  # share of gravity, at the measured posture

    def __post_init__(self) -> None:
        check_range("controller", "kp", self.kp, 1e-6, 1e9)
        check_range("controller", "kd", self.kd, 0.0, 1e9)
        check_range("controller", "gravity_compensation", self.gravity_compensation, 0.0, 1.0)


class GravityCompensation:
    """Shift of the set-points by which position drives carry the robot's weight over one foot, in one simulation."""

    stepped_at_s: float | None = None

    def __init__(self, controller: JointController, plan: Plan, model: Any) -> None:
        self._controller, self._plan, self._model = controller, plan, model
        self._engine = load_mujoco()
        self._posture, self._addresses = self._engine.MjData(model), Addresses(model, plan)
        self._feet = [model.body(plan.robot.feet[side].link).id for side in SIDES]
        rates = self._addresses.rates
        self._root = np.setdiff1d(np.arange(model.nv), rates)

    def fork(self) -> Self:
        """Return itself: it has no memory."""
        return self

    def find_plan_time(self, time_s: float) -> float:
        """Return the time of the plan at a time of the simulation: the same [s]."""
        return time_s

    def correct(self, command: Array, data: Any, step: int) -> tuple[Array, int]:
        """Return the set-points (J,) [rad] with those of gravity added, for one step of the engine."""
        return command + self._controller.gravity_compensation * self.hold(data) / self._controller.kp, 1

    def hold(self, data: Any) -> Array:
        """Return the joint torques (J,) that hold the measured posture over the foremost foot on the ground [Nm]."""
        posture, rates, time = self._posture, self._addresses.rates, np.array([data.time])
        posture.qpos[:] = data.qpos
        self._engine.mj_kinematics(self._model, posture)
        self._engine.mj_comPos(self._model, posture)
        weight = np.zeros(self._model.nv)
        self._engine.mj_rne(self._model, posture, 0, weight)  # at rates of zero: gravity alone
        places = [self._plan.at(f"{side}_foot", time)[0, 0] for side in SIDES]
        bears = [self._plan.bears(side, time)[0] for side in SIDES]
        stance = max(range(len(SIDES)), key=lambda i: (bears[i], places[i]))
        moving, turning = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        self._engine.mj_jacBody(self._model, posture, moving, turning, self._feet[stance])
        jacobian = np.vstack([moving, turning])
        # Force and moment of the foot carry the root, which no joint drives.
        wrench, *_ = np.linalg.lstsq(jacobian[:, self._root].T, weight[self._root], rcond=None)
        return np.asarray(weight[rates] - jacobian[:, rates].T @ wrench)
