"""Links and joints that cannot be used as a file has them: made one with what carries them, or repaired."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nlp_gait.robots.tree import inertia_moments, point_inertia

Array = np.ndarray[Any, np.dtype[np.float64]]


class Mass:
    """Matter as a file states it, whether or not a body can have it.

    Args:
        raw: record of a link.
    """

    def __init__(self, raw: Mapping[str, Any]) -> None:
        self.mass_kg = float(raw["mass_kg"])
        self.com_m = np.array(raw["com_m"], dtype=float)
        ixx, iyy, izz, ixy, ixz, iyz = raw["inertia_com_kgm2"]
        self.tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], dtype=float)

    def record(self) -> dict[str, Any]:
        """As a robot file has it."""
        return {
            "mass_kg": self.mass_kg,
            "com_m": self.com_m.tolist(),
            "inertia_com_kgm2": list(inertia_moments(self.tensor)),
        }

    def with_child(self, child: Mass, origin: Array) -> Mass:
        """Both as one body, the child's frame at ``origin`` (3,) [m]."""
        mass = self.mass_kg + child.mass_kg
        far = child.com_m + origin
        com = (self.mass_kg * self.com_m + child.mass_kg * far) / mass if mass > 0.0 else self.com_m
        tensor = sum(
            (part.tensor + point_inertia(part.mass_kg, at - com) for part, at in ((self, self.com_m), (child, far))),
            np.zeros((3, 3)),
        )
        return Mass({"mass_kg": mass, "com_m": com, "inertia_com_kgm2": inertia_moments(tensor)})


def repaired(raw: Mapping[str, Any]) -> dict[str, Any]:
    """The record with the nearest tensor that a body can have: no negative second moment of its matter."""
    mass = Mass(raw)
    moments, axes = np.linalg.eigh(np.trace(mass.tensor) / 2 * np.eye(3) - mass.tensor)
    spread = axes @ np.diag(np.maximum(moments, 0.0)) @ axes.T
    mass.tensor = np.trace(spread) * np.eye(3) - spread
    return mass.record()
