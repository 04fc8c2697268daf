"""What a phase minimises: mean electrical power as in the paper, or its torques, or the smoothness of its motion."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import casadi as ca
from casadi import MX

from nlp_gait.formulation import Objective, Parameter, Point
from nlp_gait.gaits.biped.samples import Quantity, Samples
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

POWER = Objective(name="power", unit="W")
HEAT_LOSS = Parameter(
    name="heat_loss_W_per_Nm2", unit="W/(Nm)^2", default=0.025, description="K, heat loss (eq. 32)", minimum=0.0
)


def compute_paper_power(point: Point, samples: Samples, ops: Nonsmooth) -> MX:
    """Compute the mean electrical power over time [W]: braking costs like driving, one K (eq. 32; (P.1), (P.2))."""
    mechanical = ca.reshape(ops.abs(ca.vec(samples.power)), *samples.power.shape)
    return samples.average(ca.sum1(mechanical) + point[HEAT_LOSS.name] * ca.sum1(samples.torque**2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Goal:
    """What is minimised: mean power, or another figure of the samples with power as an index."""

    objective: Objective = POWER  # name and unit
    figure: Callable[[Samples, Nonsmooth], MX] | None = None  # of the samples; None for power
    reads: tuple[Quantity, ...] = ()  # see ``Limit.reads``

    def evaluate(self, point: Point, samples: Samples, ops: Nonsmooth) -> tuple[MX, Mapping[str, MX]]:
        """Return the objective and the indexes: power, and what is minimised instead."""
        if self.figure is None:
            power = compute_paper_power(point, samples, ops)
            return power, {"power_W": power}
        figure = self.figure(samples, ops)
        return figure, {"power_W": compute_paper_power(point, samples, Exact()), self.objective.name: figure}


def _average_squared_rate(values: MX, samples: Samples) -> MX:
    return ca.sumsqr(values[:, 1:] - values[:, :-1]) / samples.step_s**2 / samples.steps


Criterion = Literal["power", "jerk", "torque", "torque-smoothness"]
GOALS = {
    "power": Goal(),
    "jerk": Goal(
        objective=Objective(name="joint_jerk", unit="rad^2/s^6"),
        figure=lambda samples, ops: _average_squared_rate(samples.qdd, samples),
        reads=(Samples.qdd,),
    ),
    "torque": Goal(
        objective=Objective(name="squared_torque", unit="(Nm)^2"),
        figure=lambda samples, ops: samples.average(ca.sum1(samples.torque**2)),
    ),
    "torque-smoothness": Goal(
        objective=Objective(name="torque_rate", unit="(Nm/s)^2"),
        figure=lambda samples, ops: _average_squared_rate(samples.torque, samples),
    ),
}
