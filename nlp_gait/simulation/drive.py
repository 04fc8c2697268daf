"""How the simulated robot is driven: position servos with limited torque, and set-points at a fixed period."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nlp_gait.errors import InputError
from nlp_gait.robots import Joint

# Published limits of NAO's joints differ by a factor of four: those of the robot's file (the maker's URDF), or of the motor at
# stall or in continuous service, times the gear ratio.
TORQUE_LIMITS = ("urdf", "stall", "continuous")


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Servo of every joint: torque = stiffness (set-point - angle) - damping rate, within the limits.

    The stiffness is proportional to what the joint's motor gives at stall: each reaches it at the same error.

    Attributes:
        full_error_rad: error at which a motor would give its stall torque.
        time_constant_s: damping / stiffness.
        period_s: time between set-points, each held until the next.
        torque_limits: which of the published limits holds.
    """

    full_error_rad: float = 0.08
    time_constant_s: float = 0.02
    period_s: float = 0.04
    torque_limits: str = "urdf"

    def __post_init__(self) -> None:
        """Positive numbers, a known limit."""
        for name in ("full_error_rad", "time_constant_s", "period_s"):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise InputError(f"{name} of a drive must be > 0, got {value!r}")
        if self.torque_limits not in TORQUE_LIMITS:
            raise InputError(f"torque limits must be one of {', '.join(TORQUE_LIMITS)}, got {self.torque_limits!r}")

    def stiffness(self, joint: Joint) -> float:
        """[Nm/rad]."""
        return stall_torque(joint) / self.full_error_rad

    def damping(self, joint: Joint) -> float:
        """[Nm s/rad]."""
        return self.stiffness(joint) * self.time_constant_s

    def torque_limit(self, joint: Joint) -> float:
        """[Nm]."""
        if self.torque_limits == "urdf" or joint.motor is None:
            return joint.torque_limit_Nm
        if self.torque_limits == "stall":
            return stall_torque(joint)
        return joint.motor.continuous_torque_Nm


def stall_torque(joint: Joint) -> float:
    """Torque of a joint with its motor at stall and a gear without loss [Nm]; the stated limit if no motor is known."""
    if joint.motor is None:
        return joint.torque_limit_Nm
    return joint.motor.stall_torque_Nm
