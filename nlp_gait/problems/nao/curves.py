"""Richer motions for the NAO phases: quintics and splines in place of the papers' cubics.

A curve is the papers' cubic plus a spline that leaves its ends alone. The spline's coefficients are variables after the papers'
own; with all of them at zero the motion is the papers'.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.problem import Array, Grid, InstantPoint, Variable
from nlp_gait.problems.biped.parts import AngleLimits
from nlp_gait.problems.nao.body import arm_joints, hip_motion
from nlp_gait.robots import Robot
from nlp_gait.symbolic.splines import coefficient_count, spline
from nlp_gait.symbolic.trajectories import Motion, plus, stack

Trajectory = Literal["cubic", "quintic", "spline-2", "spline-4", "spline-8", "spline-16"]
SPANS: dict[str, int] = dict(zip(get_args(Trajectory), (0, 1, 2, 4, 8, 16), strict=True))

# Samples in each interval if none are asked for: a cubic has no room between 11 samples, a spline has.
SAMPLES, SPLINE_SAMPLES = 1, 4
# Coefficients of a spline lie within these bounds, wider than any optimum's, and start within a share of them.
BOUNDS = {"m": 0.3, "rad": 3.0}
START_SHARE = 0.05

HIP_CURVES = ("hip_x", "hip_y", "hip_z")


@dataclass(frozen=True, kw_only=True)
class Splines:
    """Splines on top of the papers' cubics.

    Attributes:
        trajectory: their order.
        units: of each curve by name, ``"m"`` or ``"rad"``.
    """

    trajectory: Trajectory
    units: Mapping[str, str]

    @property
    def count(self) -> int:
        """Coefficients of each curve."""
        return coefficient_count(SPANS[self.trajectory])

    @property
    def kinks(self) -> tuple[float, ...]:
        """Knots between the ends."""
        spans = SPANS[self.trajectory]
        return tuple(k / spans for k in range(1, spans))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Coefficients, curve by curve."""
        return tuple(
            Variable(
                name=f"{curve}_{unit}[{k}]",
                unit=unit,
                lower=-BOUNDS[unit],
                upper=BOUNDS[unit],
                description=f"coefficient {k} of the spline on {curve}",
            )
            for curve, unit in self.units.items()
            for k in range(self.count)
        )

    def motions(self, at: InstantPoint, duration: SX, phase: SX) -> dict[str, Motion]:
        """What each curve adds to its cubic."""
        coefficients = ca.vertcat(*(at[variable.name] for variable in self.variables))
        added = spline(ca.reshape(coefficients, self.count, len(self.units)), duration, phase)
        return {curve: Motion(*(part[i] for part in added)) for i, curve in enumerate(self.units)}

    def start_of(self, names: Sequence[str]) -> Callable[[Mapping[str, float], np.random.Generator], Array] | None:
        """Start points of variables: the papers' anywhere within their bounds, coefficients near zero; None without any."""
        if self.count == 0:
            return None
        own = {variable.name for variable in self.variables}
        share = np.array([START_SHARE if name in own else 1.0 for name in names])

        def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
            lower, upper = (np.array([parameters[f"{name}.{end}"] for name in names]) for end in ("lower", "upper"))
            middle, half = (lower + upper) / 2, (upper - lower) / 2
            return np.asarray(middle + share * rng.uniform(-half, half))

        return start


def hip_and_arm_units(swing: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """Units of the curves that every phase has: the hip's and those of the arms' joints that swing."""
    return dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(swing, "rad")


def hip_on_spline(
    at: InstantPoint,
    more: Mapping[str, Motion],
    along: tuple[float, float],
    across: tuple[float, float],
    duration: SX,
    phase: SX,
) -> Motion:
    """Motion of the torso's origin (3,) [m]: the papers' (see ``body.hip_motion``), and what each curve adds."""
    return plus(hip_motion(at, along, across, duration, phase), stack(*(more[curve] for curve in HIP_CURVES)))


def arm_motions(
    more: Mapping[str, Motion], swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX
) -> dict[str, Motion]:
    """Motions of the arms' joints [rad]: the papers' (see ``body.arm_joints``), and what each curve adds."""
    arms = arm_joints(swing, duration, phase)
    return arms | {joint: plus(arms[joint], more[joint]) for joint in swing}


def arm_limits(
    robot: Robot, splines: Splines, swing: Mapping[str, tuple[float, float]], duration: Callable[[InstantPoint], SX]
) -> AngleLimits:
    """Limits of the arms' joints that swing, which a spline can break between the ends of a phase."""

    def angles(at: InstantPoint, phase: SX) -> SX:
        time = duration(at)
        arms = arm_motions(splines.motions(at, time, phase), swing, time, phase)
        return ca.vertcat(*(arms[joint].position for joint in swing))

    return AngleLimits("arm_angle", robot, tuple(swing), angles)


def grid_for(trajectory: str, intervals: int, samples_per_interval: int, *, planned_loads: bool = False) -> Grid:
    """Samples of a phase: as many in an interval as are asked for, or for 0 as many as suit the trajectory and the loads."""
    if samples_per_interval == 0 and not isinstance(samples_per_interval, bool):
        samples_per_interval = SPLINE_SAMPLES if planned_loads or trajectory != "cubic" else SAMPLES
    return Grid(intervals=intervals, samples_per_interval=samples_per_interval, refined_by="samples_per_interval")
