"""What may differ from the plan's ideal world: floor, friction, masses, a push."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nlp_gait.errors import InputError
from nlp_gait.simulation.mjcf import FRICTION


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Impulse on the torso's centre of mass in the middle of the phase.

    Attributes:
        impulse_Ns: (x, y) [N s].
        duration_s: over which it acts as a constant force.
    """

    impulse_Ns: tuple[float, float]
    duration_s: float = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """World and robot of one simulation.

    Attributes:
        friction: coefficient of sliding friction.
        mass_factor: on masses and inertias of all links; the gait was planned for 1.
        stiffness_factor: of the servos against what their drive assumes; their damping is as assumed.
        slope_rad: (x, y) slope of the floor: positive rises forward or to the left.
        push: none by default.
    """

    friction: float = FRICTION
    mass_factor: float = 1.0
    stiffness_factor: float = 1.0
    slope_rad: tuple[float, float] = (0.0, 0.0)
    push: Push | None = None

    def __post_init__(self) -> None:
        """Physical values only."""
        for name in ("friction", "mass_factor", "stiffness_factor"):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise InputError(f"{name} must be > 0, got {value!r}")
        if not all(abs(slope) < math.pi / 4 for slope in self.slope_rad):
            raise InputError(f"slope_rad must be within +-pi/4, got {self.slope_rad}")

    def gravity(self, magnitude: float) -> tuple[float, float, float]:
        """Gravity in the axes of the sloping floor [m/s^2]."""
        x, y = (math.tan(slope) for slope in self.slope_rad)
        scale = magnitude / math.sqrt(1.0 + x * x + y * y)
        return (-x * scale, -y * scale, -scale)
