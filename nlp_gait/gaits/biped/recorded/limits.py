"""What a recorded phase is judged by besides a planned one's limits: the hip at its ends, and both soles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.formulation import Array, Constraint, Parameter, Point, Variable
from nlp_gait.formulation.blocks import labels
from nlp_gait.gaits.biped.parts import Contribution, Part, rows
from nlp_gait.gaits.biped.recorded.motion import FINE, Motion
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

CORNERS = ("back right", "back left", "front right", "front left")
# How far a recorded sole may be from where it should stand: rounding, and the spline between samples.
GROUND_TOLERANCE = Parameter(
    name="ground_tolerance_m",
    unit="m",
    default=5e-4,
    description="a sole nearer than this to the ground, or to where it stood, stands",
    minimum=0.0,
)


class HipLimits(Part):
    """The hip at both ends within the ranges of the planned motion's variables.

    Args:
        variables: by what they limit, ``z``, ``vx``, ``vy``, ``vz`` and more, at the start and at the end; None for no limit.
        labels: of both ends.
    """

    def __init__(self, variables: Sequence[Mapping[str, Variable]], labels: Sequence[str]) -> None:
        self._variables, self._labels = variables, labels
        unique = {v.name: v for limits in variables for v in limits.values()}
        self.parameters = bounds_of(tuple(unique.values()))

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        hip, rate = samples.traces["hip"], samples.traces["hip_rate"]
        found = []
        for end, limits, label in zip((0, hip.shape[1] - 1), self._variables, self._labels, strict=False):
            values = {axis: hip[k, end] for k, axis in enumerate("xyz")}
            values |= {f"v{axis}": rate[k, end] for k, axis in enumerate("xyz")}
            for key, variable in limits.items():
                low, high = at[f"{variable.name}.lower"], at[f"{variable.name}.upper"]
                found.append(
                    Constraint(
                        name=f"hip_{key}_{label}",
                        unit=variable.unit,
                        scale=variable.upper - variable.lower,  # as a bound of the variable itself
                        value=values[key],
                        lower=low,
                        upper=high,
                    )
                )
        return Contribution(rows=tuple(found))


class SwingLimits(Part):
    """A swinging right foot: on the ground at both ends, above it and beside the other one in between, lifted as asked for.

    Args:
        motion: recorded.
        lift: variable that says how high it goes.
    """

    def __init__(self, motion: Motion, lift: Variable) -> None:
        self._motion, self._lift = motion, lift
        self.parameters = (GROUND_TOLERANCE, *bounds_of((lift,)))
        self._inner_edge = motion.stance.support[1] - motion.stance.robot.feet["left"].right_m

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows; the greatest height is of the whole motion, not of the samples alone."""
        heights, sides, tolerance = samples.traces["heights"], samples.traces["sides"], at[GROUND_TOLERANCE.name]
        inside = range(1, samples.steps)
        highest = MX(float(self._motion.right_foot(np.linspace(0.0, self._motion.duration_s, FINE))[:, 2].max()))
        ends = ca.horzcat(heights[:, 0], heights[:, -1])
        lift = self._lift.name
        return Contribution(
            rows=(
                rows("foot_stands", "m", ca.vec(ends), -tolerance, tolerance, labels(CORNERS, (0, samples.steps))),
                rows("foot_height", "m", ca.vec(heights[:, 1:-1]), -tolerance, labels=labels(CORNERS, inside)),
                rows(
                    "feet_apart",
                    "m",
                    self._inner_edge - ca.vec(sides[1::2, 1:-1]),
                    MX(0.0),
                    labels=labels(CORNERS[1::2], inside),
                ),
                rows("swing_height", "m", highest, at[f"{lift}.lower"], at[f"{lift}.upper"]),
            ),
            indexes={"swing_height_m": highest},
        )


class StandingLimits(Part):
    """A right foot that stands: its sole on the ground, and where it is in the mean."""

    parameters = (GROUND_TOLERANCE,)

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows."""
        heights, ground, tolerance = samples.traces["heights"], samples.traces["ground"], at[GROUND_TOLERANCE.name]
        n = samples.steps + 1
        drift = ground - ca.repmat(ca.sum2(ground) / n, 1, n)
        every = range(n)
        return Contribution(
            rows=(
                rows("foot_stands", "m", ca.vec(heights), -tolerance, tolerance, labels(CORNERS, every)),
                rows("foot_still", "m", ca.vec(drift), -tolerance, tolerance, labels(("x", "y"), every)),
            )
        )


def bounds_of(variables: Sequence[Variable]) -> tuple[Parameter, ...]:
    """Bounds of a planned motion's variables as parameters."""
    return tuple(bound for v in variables for bound in (v.bound("lower"), v.bound("upper")))


def mean_place(motion: Motion) -> Array:
    """Where the right sole stands in the mean (2,) [m]."""
    foot = motion.right_foot(np.linspace(0.0, motion.duration_s, FINE))
    return np.asarray(foot[:, :2].mean(axis=0) + (0.0, motion.stance.support[1]))
