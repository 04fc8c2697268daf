"""Curves of a phase: the paper's cubics of the hip, and quintics and splines that are added to any cubic.

A curve is the paper's cubic plus a spline that leaves both ends unchanged. The spline's coefficients are variables after those of
the paper; if all are zero, the motion is the paper's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array, InstantPoint, Start, Variable
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.symbolic.trajectories import Motion, add_motions, count_coefficients, cubic, spline, stack

Trajectory = Literal["cubic", "quintic", "spline-2", "spline-4", "spline-8", "spline-16"]
SPANS: dict[str, int] = dict(zip(get_args(Trajectory), (0, 1, 2, 4, 8, 16), strict=True))

# Coefficients of a spline lie within these bounds, wider than any optimum's, and start within a share of them.
BOUNDS = {"m": 0.3, "rad": 3.0}
START_SHARE = 0.05

HIP_CURVES = ("hip_x", "hip_y", "hip_z")


@dataclass(frozen=True, kw_only=True)
class Splines:
    """Splines that are added to cubics."""

    trajectory: Trajectory  # their order
    units: Mapping[str, str]  # of each curve by name, ``"m"`` or ``"rad"``
    length_scale: float = 1.0  # of the bounds in metres, for a robot of another size than NAO

    @property
    def count(self) -> int:
        """Coefficients of each curve."""
        return count_coefficients(SPANS[self.trajectory])

    @property
    def kinks(self) -> tuple[float, ...]:
        """Knots between the ends."""
        spans = SPANS[self.trajectory]
        return tuple(k / spans for k in range(1, spans))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Coefficients, curve by curve."""
        bounds = BOUNDS | {"m": BOUNDS["m"] * self.length_scale}
        rows = (
            (f"{curve}_{unit}[{k}]", unit, -bounds[unit], bounds[unit], f"coefficient {k} of the spline on {curve}")
            for curve, unit in self.units.items()
            for k in range(self.count)
        )
        return make_variables(*rows)

    def motions(self, point: InstantPoint, duration: SX, phase: SX) -> dict[str, Motion]:
        """Return what each curve adds to its cubic."""
        coefficients = ca.vertcat(*(point[variable.name] for variable in self.variables))
        added = spline(ca.reshape(coefficients, self.count, len(self.units)), duration, phase)
        return {curve: Motion(*(order[i] for order in added)) for i, curve in enumerate(self.units)}

    def start_of(self, names: Sequence[str]) -> Start | None:
        """Return start points with coefficients near zero and the other variables within their bounds; None without splines."""
        if self.count == 0:
            return None
        coefficients = {variable.name for variable in self.variables}
        share = np.array([START_SHARE if name in coefficients else 1.0 for name in names])

        def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
            lower, upper = (np.array([parameters[f"{name}.{end}"] for name in names]) for end in ("lower", "upper"))
            middle, half = (lower + upper) / 2, (upper - lower) / 2
            return np.asarray(middle + share * rng.uniform(-half, half))

        return start


def move_hip(
    point: InstantPoint,
    curves: Mapping[str, Motion],
    along: tuple[float, float],
    across: tuple[float, float],
    duration: SX,
    phase: SX,
) -> Motion:
    """Return the hip's motion (3,) [m]: the paper's cubics ``along`` and ``across`` from end to end, and what each curve adds.

    Height and velocities are the variables hip_height_m and hip_v<axis>_<end>_m_s.

    Source:
        Gupta, Pratihar, Deb (2023), Table 3, rows 3 to 5, and Table 5, rows 1 to 3.
    """
    height = point["hip_height_m"]
    ends = {"x": (SX(along[0]), SX(along[1])), "y": (SX(across[0]), SX(across[1])), "z": (height, height)}
    paper = (
        cubic(start, end, point[f"hip_v{axis}_start_m_s"], point[f"hip_v{axis}_end_m_s"], duration, phase)
        for axis, (start, end) in ends.items()
    )
    return add_motions(stack(*paper), stack(*(curves[curve] for curve in HIP_CURVES)))
