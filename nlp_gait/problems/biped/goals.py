"""What a phase minimises: mean electrical power as in the paper, or the smoothness of its motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import casadi as ca
from casadi import MX

from nlp_gait.problem import Objective, Parameter, Point
from nlp_gait.problems.biped.samples import Samples, time_mean
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

HEAT_LOSS = Parameter(
    name="heat_loss_W_per_Nm2", unit="W/(Nm)^2", default=0.025, description="K, heat loss (eq. 32)", minimum=0.0
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Value:
    """A goal at a point, and the indexes that stand before and after those of the parts."""

    value: MX
    first: Mapping[str, MX]
    last: Mapping[str, MX] = field(default_factory=dict)


class Goal(Protocol):
    """What is minimised."""

    @property
    def objective(self) -> Objective:
        """Name and unit."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Weights."""

    @property
    def reads_motion(self) -> bool:
        """Whether it reads angles and their derivatives."""

    def value(self, at: Point, samples: Samples, ops: Nonsmooth) -> Value:
        """At a point."""


# Mean electrical power [W] of samples at a point; absolute values as the interpretation has them.
Draw = Callable[[Point, Samples, Nonsmooth], MX]


def paper_draw(at: Point, samples: Samples, ops: Nonsmooth) -> MX:
    """Mean electrical power by the trapezoidal rule [W]: braking draws as much as driving, K for all joints (eq. 32)."""
    mechanical = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    return time_mean(ca.sum1(mechanical) + at[HEAT_LOSS.name] * ca.sum1(samples.torque**2))


@dataclass(frozen=True, kw_only=True)
class MeanPower:
    """Mean electrical power.

    Attributes:
        draw: how the motors draw it; where not as in the paper, the paper's power stands beside it.
    """

    draw: Draw = paper_draw
    objective = Objective(name="power", unit="W")
    parameters = (HEAT_LOSS,)
    reads_motion = False

    def value(self, at: Point, samples: Samples, ops: Nonsmooth) -> Value:
        """See ``Goal``."""
        power = self.draw(at, samples, ops)
        beside = {} if self.draw is paper_draw else {"paper_power_W": paper_draw(at, samples, Exact())}
        return Value(value=power, first={"power_W": power}, last=beside)


@dataclass(frozen=True, kw_only=True)
class Smoothness:
    """Mean squared rate of joint accelerations or of torques; power is an index beside it.

    Attributes:
        objective: name and unit.
        of: the samples whose rate it is, (m, N + 1).
    """

    objective: Objective
    of: Callable[[Samples], MX]
    reads_motion: bool
    parameters = (HEAT_LOSS,)

    def value(self, at: Point, samples: Samples, ops: Nonsmooth) -> Value:
        """Mean over time of the sum over joints of squared differences of neighbouring samples, over squared time."""
        values = self.of(samples)
        rate = ca.sumsqr(values[:, 1:] - values[:, :-1]) / samples.step_s**2 / samples.steps
        power = paper_draw(at, samples, Exact())
        return Value(value=rate, first={"power_W": power}, last={self.objective.name: rate})


SMOOTHNESS = {
    "jerk": Smoothness(
        objective=Objective(name="joint_jerk", unit="rad^2/s^6"), of=lambda samples: samples.qdd, reads_motion=True
    ),
    "torque-smoothness": Smoothness(
        objective=Objective(name="torque_rate", unit="(Nm/s)^2"), of=lambda samples: samples.torque, reads_motion=False
    ),
}
