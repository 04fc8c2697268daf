"""Your own problem and two algorithms, accepted wherever a name is, as ``FILE.py:NAME``.

``nlp-gait compare bring_your_own.py:two_link --algorithms pso,bring_your_own.py:Shrinking,bring_your_own.py:annealing --runs 5``
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import DM, MX
from scipy.optimize import dual_annealing

import metaheuristics
import nlp_gait
from nlp_gait.formulation import (
    Assembly,
    Constraint,
    Display,
    GaitProblem,
    Grid,
    NumericPoint,
    Objective,
    Parameter,
    Point,
    Signals,
    Variable,
    make_vector_columns,
    maker,
)

LENGTH, MASS, GRAVITY = 0.4, 1.5, 9.81  # of each link [m], at its end [kg]; [m/s^2]
HIP_HEIGHT = 0.77  # [m]
JOINTS = ("hip", "knee")


@maker
def two_link(*, intervals: int = 20, lift_m: float = 0.05) -> GaitProblem:
    """A leg of two links swings from behind to ahead of the hip at least mean power, its foot above the ground."""
    s = DM(np.linspace(0.0, 1.0, intervals + 1)).T
    names = ("swing_rad", "bend_rad", "time_s")

    def motion(at: Point) -> tuple[MX, MX, MX]:
        """Angles (2, N + 1), their rates, and torques."""
        swing, bend, time = (at[name] for name in names)
        rise, rate, accel = 3 * s**2 - 2 * s**3, (6 * s - 6 * s**2) / time, (6 - 12 * s) / time**2
        knee, knee_rate = 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s) / time
        knee_accel = (32 - 192 * s + 192 * s**2) / time**2
        q = ca.vertcat(swing * (2 * rise - 1), -bend * knee)
        qd = ca.vertcat(2 * swing * rate, -bend * knee_rate)
        qdd = ca.vertcat(2 * swing * accel, -bend * knee_accel)
        shank, both = q[0, :] + q[1, :], MASS * LENGTH**2
        c, coriolis = ca.cos(q[1, :]), ca.sin(q[1, :])
        knee_torque = both * ((1 + c) * qdd[0, :] + qdd[1, :] + coriolis * qd[0, :] ** 2)
        hip_torque = both * ((3 + 2 * c) * qdd[0, :] + (1 + c) * qdd[1, :])
        hip_torque -= both * coriolis * (2 * qd[0, :] * qd[1, :] + qd[1, :] ** 2)
        weight = MASS * GRAVITY * LENGTH
        hip_torque += weight * (2 * ca.sin(q[0, :]) + ca.sin(shank))
        return q, qd, ca.vertcat(hip_torque, knee_torque + weight * ca.sin(shank))

    def clearance(q: MX) -> MX:
        """Foot above the ground (1, N + 1) [m]."""
        return HIP_HEIGHT - LENGTH * (ca.cos(q[0, :]) + ca.cos(q[0, :] + q[1, :]))

    def assemble(at: Point, ops: object) -> Assembly:
        q, qd, tau = motion(at)
        power = ca.sum1(ops.abs(ca.vec(qd * tau))) / (intervals + 1) + 0.01 * ca.sumsqr(tau) / (intervals + 1)
        labels = tuple(str(k) for k in range(1, intervals))
        rows = (
            Constraint(name="clearance", labels=labels, unit="m", scale=0.01, value=clearance(q)[1:-1].T, lower=MX(0.0)),
            Constraint(name="lift", unit="m", scale=0.01, value=clearance(q)[intervals // 2], lower=MX(lift_m)),
            Constraint(name="speed", unit="m/s", scale=0.1, lower=at["speed_m_s"],
                       value=4 * LENGTH * ca.sin(at["swing_rad"]) / at["time_s"]),
        )  # fmt: skip
        return Assembly(
            objective=power, constraints=rows, metrics={"power_W": power, "lift_m": clearance(q)[intervals // 2]}
        )

    def signals(at: NumericPoint) -> Signals:
        q, qd, tau = (ca.evalf(part).full().T for part in motion(at))
        t = float(at["time_s"]) * s.full()[0]
        both = q.sum(axis=1)
        foot = LENGTH * np.column_stack([np.sin(q[:, 0]) + np.sin(both), -np.cos(q[:, 0]) - np.cos(both)])
        arrays = {"t": t, "q": q, "qd": qd, "tau": tau, "foot": foot}
        return Signals(joints=JOINTS, arrays=arrays, columns={"foot": make_vector_columns("m", "xz")})

    return GaitProblem(
        name="two-link",
        title="A leg of two links, swinging: least mean power",
        variables=(
            Variable(name="swing_rad", unit="rad", lower=0.1, upper=0.6, description="of the thigh, to either side"),
            Variable(name="bend_rad", unit="rad", lower=0.0, upper=1.5, description="of the knee, halfway"),
            Variable(name="time_s", unit="s", lower=0.2, upper=2.0, description="of the swing"),
        ),
        own_parameters=(Parameter(name="speed_m_s", unit="m/s", default=0.6, description="least speed of walking"),),
        objective=Objective(name="power", unit="W"),
        assemble=assemble,
        grid=Grid(intervals=intervals, refined_by="intervals"),
        display=Display(motion=signals),
    )


@dataclass(frozen=True, kw_only=True)
class Shrinking:
    """Random points around the best one in a shrinking box: an algorithm with ask and tell."""

    population: int = 20
    shrink: float = 0.95
    name = "shrinking"

    def start(self, start):
        return ShrinkingSearch(self, start)


class ShrinkingSearch:
    def __init__(self, settings, start):
        self.settings, self.s, self.X, self.best, self.width = settings, start, start.initial, None, 0.5

    def ask(self):
        return self.X

    def tell(self, X, f, violation, rule):
        if self.best is not None:
            X, f, violation = (
                np.vstack([self.best[0], X]),
                np.append(self.best[1], f),
                np.append(self.best[2], violation),
            )
        k = rule.best(f, violation)
        self.best, self.width = (X[k], f[k], violation[k]), self.width * self.settings.shrink
        span = (
            self.width
            * (self.s.upper - self.s.lower)
            * self.s.rng.uniform(-1, 1, (self.settings.population, len(X[k])))
        )
        self.X = np.clip(X[k] + span, self.s.lower, self.s.upper)

    def stop(self):
        return ()


def annealing(f, lower, upper, evaluations, seed):
    """SciPy's simulated annealing: a plain function, stopped by the loop at its budget."""
    dual_annealing(f, list(zip(lower, upper, strict=True)), maxfun=evaluations, seed=seed)


def main() -> None:
    """Run all three, as ``nlp-gait compare`` does."""
    problem = two_link()
    optimum = nlp_gait.solve(problem, starts=5)
    print(f"IPOPT: power {optimum.objective:.4f} W")
    objective = nlp_gait.compile_objective(problem)
    for own in (Shrinking, annealing):
        algorithm = metaheuristics.to_algorithm(own, own.__name__)
        result = metaheuristics.minimize(objective, algorithm, evaluations=2000)
        print(f"{own.__name__}, {result.evaluations} evaluations: power {result.objective:.4f} W")


if __name__ == "__main__":
    main()
