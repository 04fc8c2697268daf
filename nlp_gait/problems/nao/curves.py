"""Richer motions for the NAO phases: quintics and splines in place of the papers' cubics.

A curve is the papers' cubic plus a spline that leaves its ends alone. The spline's coefficients are variables after the papers'
own; with all of them at zero the motion is the papers'.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, Variable
from nlp_gait.problems.nao.body import arm_joints, hip_motion
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
        first: number of variables before the coefficients.
    """

    trajectory: Trajectory
    units: Mapping[str, str]
    first: int

    def __post_init__(self) -> None:
        """Refuse an unknown order."""
        if self.trajectory not in SPANS:
            raise InputError(f"trajectory must be one of {', '.join(SPANS)}, got {self.trajectory!r}")

    @property
    def count(self) -> int:
        """Coefficients of each curve."""
        return coefficient_count(SPANS[self.trajectory])

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

    def motions(self, x: SX, duration: SX, phase: SX) -> dict[str, Motion]:
        """What each curve adds to its cubic, from x (n,)."""
        m, k = self.count, len(self.units)
        added = spline(ca.reshape(x[self.first : self.first + m * k], m, k), duration, phase)
        return {curve: Motion(*(part[i] for part in added)) for i, curve in enumerate(self.units)}

    def start(self, lower: Array, upper: Array, rng: np.random.Generator) -> Array:
        """Start point: the papers' variables anywhere within their bounds, coefficients near zero."""
        share = np.ones(len(lower))
        share[self.first :] = START_SHARE
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        return middle + share * rng.uniform(-half, half)


def hip_and_arm_units(swing: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """Units of the curves that every phase has: the hip's and those of the arms' joints that swing."""
    return dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(swing, "rad")


def hip_on_spline(
    x: SX,
    more: Mapping[str, Motion],
    along: tuple[float, float],
    across: tuple[float, float],
    duration: SX,
    phase: SX,
) -> Motion:
    """Motion of the torso's origin (3,) [m]: the papers' (see ``nao.hip_motion``), and what each curve adds."""
    return plus(hip_motion(x[:7], along, across, duration, phase), stack(*(more[curve] for curve in HIP_CURVES)))


def arm_motions(
    more: Mapping[str, Motion], swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX
) -> dict[str, Motion]:
    """Motions of the arms' joints [rad]: the papers' (see ``nao.arm_joints``), and what each curve adds."""
    arms = arm_joints(swing, duration, phase)
    return arms | {joint: plus(arms[joint], more[joint]) for joint in swing}


def samples_in_interval(trajectory: str, samples_per_interval: int) -> int:
    """Number of samples in an interval: what is asked for, or for 0 what suits the trajectory."""
    if samples_per_interval != 0 or isinstance(samples_per_interval, bool):
        return samples_per_interval
    return SAMPLES if trajectory == "cubic" else SPLINE_SAMPLES


def motion_options(trajectory: str, criterion: str, samples_per_interval: int) -> dict[str, str | int]:
    """Options of a problem that say how its motion differs from the papers'; none if it does not."""
    given = (trajectory, criterion, samples_per_interval)
    names = ("trajectory", "objective", "samples_per_interval")
    return {} if given == ("cubic", "power", SAMPLES) else dict(zip(names, given, strict=True))
