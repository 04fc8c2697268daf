"""What a phase minimises: mean electrical power as in the paper, or its torques, or the smoothness of its motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca
from casadi import MX

from nlp_gait.formulation import Objective, Parameter, Point
from nlp_gait.gaits.biped.samples import Samples, time_mean
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

POWER = Objective(name="power", unit="W")
HEAT_LOSS = Parameter(
    name="heat_loss_W_per_Nm2", unit="W/(Nm)^2", default=0.025, description="K, heat loss (eq. 32)", minimum=0.0
)

# Mean electrical power [W] of samples at a point; absolute values as the interpretation has them.
Draw = Callable[[Point, Samples, Nonsmooth], MX]


def paper_draw(at: Point, samples: Samples, ops: Nonsmooth) -> MX:
    """Mean electrical power by the trapezoidal rule [W]: braking draws as much as driving, K for all joints (eq. 32)."""
    mechanical = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    return time_mean(ca.sum1(mechanical) + at[HEAT_LOSS.name] * ca.sum1(samples.torque**2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Goal:
    """What is minimised: mean power, or another figure of the samples with power as an index beside it.

    Attributes:
        objective: name and unit.
        draw: how the motors draw power; where not as in the paper, the paper's power is an index too.
        figure: of the samples; None for power.
        reads_motion: whether it reads angles or their derivatives.
        heat: K, with the robot's default.
    """

    objective: Objective = POWER
    draw: Draw = paper_draw
    figure: Callable[[Samples], MX] | None = None
    reads_motion: bool = False
    heat: Parameter = HEAT_LOSS

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """K alone."""
        return (self.heat,)

    def value(self, at: Point, samples: Samples, ops: Nonsmooth) -> tuple[MX, Mapping[str, MX], Mapping[str, MX]]:
        """Scalar, and the indexes that stand before and after those of the parts."""
        if self.figure is not None:
            figure = self.figure(samples)
            return figure, {"power_W": paper_draw(at, samples, Exact())}, {self.objective.name: figure}
        power = self.draw(at, samples, ops)
        beside = {} if self.draw is paper_draw else {"paper_power_W": paper_draw(at, samples, Exact())}
        return power, {"power_W": power}, beside


def _mean_squared_rate(values: MX, samples: Samples) -> MX:
    """Of columns (m, N + 1), one a sample."""
    return ca.sumsqr(values[:, 1:] - values[:, :-1]) / samples.step_s**2 / samples.steps


# What can be minimised in place of the power.
INSTEAD = {
    "jerk": Goal(
        objective=Objective(name="joint_jerk", unit="rad^2/s^6"),
        figure=lambda samples: _mean_squared_rate(samples.qdd, samples),
        reads_motion=True,
    ),
    "torque": Goal(
        objective=Objective(name="squared_torque", unit="(Nm)^2"),
        figure=lambda samples: time_mean(ca.sum1(samples.torque**2)),
    ),
    "torque-smoothness": Goal(
        objective=Objective(name="torque_rate", unit="(Nm/s)^2"),
        figure=lambda samples: _mean_squared_rate(samples.torque, samples),
    ),
}
