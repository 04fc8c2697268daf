"""
Your own walker
===============

A problem is a function that makes a `GaitProblem`: here two legs with a hip mass and foot masses, the swinging leg shortened by a
slider, from Lagrange's equations. It can be used like any shipped problem: `nlp-gait compare FILE.py:walker`.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
from casadi import DM, MX, SX

import nlp_gait
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Objective, Parameter, Variable, maker
from nlp_gait.symbolic.dynamics import equations_of_motion

LENGTH, HIP, FOOT, GRAVITY, N = 0.8, 20.0, 2.0, 9.81, 20  # [m], [kg], [kg], [m/s^2], intervals of a step
q, qd, qdd, s = SX.sym("q", 3), SX.sym("qd", 3), SX.sym("qdd", 3), SX.sym("s")  # stance leg, swing leg, slider
hip = LENGTH * ca.vertcat(ca.sin(q[0]), ca.cos(q[0]))
foot = hip + (LENGTH - q[2]) * ca.vertcat(ca.sin(q[1]), -ca.cos(q[1]))
kinetic = 0.5 * (HIP * ca.sumsqr(ca.jtimes(hip, q, qd)) + FOOT * ca.sumsqr(ca.jtimes(foot, q, qd)))
law = equations_of_motion(kinetic, GRAVITY * (HIP * hip[1] + FOOT * foot[1]), q, qd)
forces = ca.Function("forces", [q, qd, qdd], [law.M @ qdd + law.C @ qd + law.G]).map(N + 1)
places = ca.Function("places", [q], [hip, foot]).map(N + 1)
shapes = ca.vertcat(2 * s - 1, s * (1 - s) * (1 - 2 * s), 16 * s**2 * (1 - s) ** 2)  # forward, sway, lift
rates = ca.jacobian(shapes, s)
phases = DM(np.linspace(0, 1, N + 1)).T
curves = [ca.Function("c", [s], [c]).map(N + 1)(phases) for c in (shapes, rates, ca.jacobian(rates, s))]
BOUNDS = {"angle_rad": (0.05, 0.5), "sway_rad": (-2, 2), "swing_rad": (-4, 4), "lift_m": (0, 0.2), "time_s": (0.2, 2)}


# %%
# The motion: three curves of five variables. The objective is power, the rows are clearance and speed.


def motion(at):
    """Coordinates, their rates and accelerations, each (3, N + 1)."""
    a, sway, swing, lift, time = (at[name] for name in BOUNDS)
    weights = ca.vertcat(ca.horzcat(a, sway, 0), ca.horzcat(a, swing, 0), ca.horzcat(0, 0, lift))
    return [weights @ curve / time**order for order, curve in enumerate(curves)]


def assemble(at, ops):
    q, qd, qdd = motion(at)
    tau, height = forces(q, qd, qdd), places(q)[1][1, 3:-3].T
    speed = 2 * LENGTH * ca.sin(at["angle_rad"]) / at["time_s"]
    power = (ca.sum1(ops.abs(ca.vec(tau * qd))) + 1e-4 * ca.sumsqr(tau)) / (N + 1)
    labels = tuple(str(k) for k in range(3, N - 2))
    rows = (
        Constraint(name="clearance", labels=labels, unit="m", scale=0.01, value=height, lower=MX(0.005)),
        Constraint(name="speed", unit="m/s", scale=0.1, value=speed, lower=at["speed_m_s"]),
    )
    return Assembly(objective=power, constraints=rows, metrics={"speed_m_s": speed})


# %%
# The maker names variables, bounds and parameters.


@maker
def walker() -> GaitProblem:
    """A step of two legs at least power, at a speed."""
    variables = tuple(Variable(name=name, unit=name.split("_")[-1], lower=low, upper=high, description="of the step")
                      for name, (low, high) in BOUNDS.items())  # fmt: skip
    parameters = (Parameter(name="speed_m_s", unit="m/s", default=0.5, description="least speed of walking"),)
    return GaitProblem(name="walker", title="Two legs at least power", variables=variables, own_parameters=parameters,
                       objective=Objective(name="power", unit="W"), assemble=assemble)  # fmt: skip


# %%
# IPOPT solves it from five random starts; the stick figures show every fourth sample.

if __name__ == "__main__":
    solution = nlp_gait.solve(walker(), starts=5)
    print(solution, *(f"{a.name}: {a.price:.3g} {a.price_unit}" for a in solution.active_constraints), sep="\n  ")
    hips, feet = (np.array(place) for place in places(motion(walker().at(solution.x))[0]))
    figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
    for k in range(0, N + 1, 4):
        axes.plot([0, hips[0, k]], [0, hips[1, k]], "C0", alpha=0.3 + 0.7 * k / N)
        axes.plot([hips[0, k], feet[0, k]], [hips[1, k], feet[1, k]], "C1", alpha=0.3 + 0.7 * k / N)
    axes.set(xlabel="x [m]", ylabel="z [m]", title=f"{solution.objective:.3f} W at 0.5 m/s", aspect="equal")
