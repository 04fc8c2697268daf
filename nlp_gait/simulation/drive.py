"""Position drives of the simulated robot: stiffness, torque limits, set-points, and feed-forward."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.robots import Joint
from nlp_gait.simulation.engine import PERIODS_S, check_range
from nlp_gait.simulation.joint_controller import GravityCompensation, JointController
from nlp_gait.simulation.plan import Plan

# Published limits of NAO's joints differ by a factor of four: from the robot's file (the manufacturer's URDF), or from the motor
# at stall or in continuous service, times the gear ratio.
TORQUE_LIMITS = ("urdf", "stall", "continuous")
UNLIMITED_NM = 1e6
ROUNDING = 1e-9  # in periods: a set-point is valid from its own time
INTERPOLATIONS = ("linear", "held")  # between two set-points
FEED_FORWARD = ("torque", "velocity", "none")  # torque includes velocity


class Corrector(Protocol):
    """Corrects the set-points of one simulation."""

    stepped_at_s: float | None  #: begin of a step at rest, None without one

    def fork(self) -> Self:
        """Return a copy for a simulation that begins in the middle of this one."""

    def find_plan_time(self, time_s: float) -> float:
        """Return the time of the plan that the robot follows at a time of the simulation [s]."""

    def correct(self, command: Array, data: Any, step: int) -> tuple[Array, int]:
        """Return the set-points (J,) [rad] instead of a planned one at a step of the engine, and for how many steps."""


class Feedback(Protocol):
    """Settings of a feedback."""

    def make_corrector(self, plan: Plan, drive: "Drive", model: Any) -> Corrector:
        """Return what corrects the set-points of one simulation of the plan, whose nominal model this is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Position drive of every joint: torque = stiffness (set-point - angle) - damping rate, within the limits.

    The stiffness is proportional to the stall torque of the joint's motor: all motors reach it at the same error. The drive
    also follows a planned velocity and torque if its set-point is shifted by damping / stiffness times the velocity, and by
    the torque / stiffness (``set_points``).
    """

    full_error_rad: float = 0.08  #: error at which a motor reaches its stall torque
    time_constant_s: float = 0.02  #: damping / stiffness
    period_s: float = 0.01  #: time between set-points; NAO's own controller works in cycles of 10 ms
    #: ``linear`` between set-points, as NAO's controller does between timed commands, or each ``held``
    interpolation: str = "linear"
    feed_forward: str = "torque"  #: ``torque`` (and velocity), ``velocity``, or ``none``
    torque_limits: str = "urdf"  #: source of the limits
    feedback: Feedback | None = None  #: corrects the set-points; None for open loop
    controller: JointController | None = None  #: gains instead of the motors' stiffness, on desired angles and rates

    def __post_init__(self) -> None:
        check_range("drive", "full_error_rad", self.full_error_rad, 1e-9, 1e3)
        check_range("drive", "time_constant_s", self.time_constant_s, 1e-6, 1e3)
        check_range("drive", "period_s", self.period_s, *PERIODS_S)
        allowed = {"interpolation": INTERPOLATIONS, "feed_forward": FEED_FORWARD, "torque_limits": TORQUE_LIMITS}
        for name, names in allowed.items():
            if getattr(self, name) not in names:
                words = name.replace("_", " ")
                raise InputError(f"{words} of a drive must be one of {', '.join(names)}, got {getattr(self, name)!r}")
        if self.controller is not None and self.feedback is not None:
            raise InputError("a drive has a controller or a feedback, got both")

    def stiffness(self, joint: Joint) -> float:
        """Return the stiffness of a joint's drive [Nm/rad]."""
        if self.controller is not None:
            return self.controller.kp
        return find_stall_torque(joint) / self.full_error_rad

    def damping(self, joint: Joint) -> float:
        """Return the damping of a joint's drive [Nm s/rad]."""
        return self.stiffness(joint) * self.time_constant_s if self.controller is None else self.controller.kd

    def set_points(self, sample: Callable[[str, Array], Array], times: Array, joints: Sequence[Joint]) -> Array:
        """Return the set-points at times (T,) [s] of joints, (T, J) [rad]: planned angles, shifted by the feed-forward.

        ``at`` returns planned ``q`` [rad], ``qd`` [rad/s] and ``tau`` [Nm] at any times (N,), each (N, J).
        """
        before, share = np.divmod(times / self.period_s + ROUNDING, 1.0)
        last = int(before[-1]) + 1
        grid = self.period_s * np.arange(last + 1.0)
        if self.controller is None:
            sent = self._shift(joints, *(sample(name, grid) for name in ("q", "qd", "tau")))
        else:
            lead = self.controller.kd / self.controller.kp
            sent = sample("q_desired", grid) + lead * sample("qd_desired", grid)
        k = before.astype(int)
        if self.interpolation == "held":
            return sent[k]
        return np.asarray(sent[k] + np.maximum(share - ROUNDING, 0.0)[:, None] * (sent[k + 1] - sent[k]))

    def _shift(self, joints: Sequence[Joint], q: Array, qd: Array, tau: Array) -> Array:
        if self.feed_forward == "none":
            return q
        shifted = q + self.time_constant_s * qd
        if self.feed_forward == "velocity":
            return shifted
        return shifted + tau / np.array([self.stiffness(joint) for joint in joints])

    def make_corrector(self, plan: Plan, make_model: Callable[[], Any]) -> Corrector | None:
        """Return what corrects the set-points of one simulation, None in open loop; feedback knows the nominal model."""
        if self.controller is not None and self.controller.gravity_compensation > 0.0:
            return GravityCompensation(self.controller, plan, make_model())
        return None if self.feedback is None else self.feedback.make_corrector(plan, self, make_model())

    def torque_limit(self, joint: Joint) -> float:
        """Return the torque limit of a joint [Nm]; the paper's controller has none."""
        if self.controller is not None:
            return UNLIMITED_NM
        if self.torque_limits == "urdf" or joint.motor is None:
            return min(joint.torque_limit_Nm, UNLIMITED_NM)
        if self.torque_limits == "stall":
            return find_stall_torque(joint)
        return joint.motor.continuous_torque_Nm


def find_stall_torque(joint: Joint) -> float:
    """Return the torque of a joint at stall with a lossless gear [Nm]; the stated limit or nominal torque of unknown motors."""
    if joint.motor is not None:
        return joint.motor.stall_torque_Nm
    return joint.torque_limit_Nm if joint.torque_limit_Nm < UNLIMITED_NM else joint.nominal_torque_Nm


# By name: as NAO's own controller, and set-points held for 40 ms, the sampling of the paper's gaits.
DRIVES = {"feed-forward": Drive(), "held": Drive(period_s=0.04, interpolation="held", feed_forward="none")}
