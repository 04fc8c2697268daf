"""
Your own objective
==================

The same gait with another objective: power plus a price on the duration of the step. It is written once; IPOPT uses it with
exact derivatives, PSO as compiled code.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import metaheuristics
import nlp_gait
from nlp_gait.formulation import Objective, Parameter


def add_price_of_time(gait, point, ops):
    """Return the gait with the price of time added to its objective."""
    return replace(gait, objective=gait.objective + point["price_of_time_W_s"] * point["single_support_time_s"])


problem = nlp_gait.load("nao-ssp").derive(
    name="nao-ssp-in-a-hurry",
    objective=Objective(name="power and time", unit="W"),
    parameters=[
        Parameter(name="price_of_time_W_s", unit="W/s", default=0.3, description="price of a second", minimum=0.0)
    ],
    change=add_price_of_time,
)

# %%
# The higher the price of time, the faster the best step.

prices, times = (0.0, 0.1, 0.3, 1.0), []
for price in prices:
    solution = nlp_gait.solve(problem.with_values(price_of_time_W_s=price), starts=1, seed=0)
    times.append(solution.x["single_support_time_s"])
    print(f"{price} W/s: {solution.objective:.6f} W in {times[-1]:.3f} s, {solution.status}")

# %%
# A search uses the same problem.

search = metaheuristics.minimize(nlp_gait.compile_objective(problem), metaheuristics.ParticleSwarm(), evaluations=5_000)
print(f"PSO at 0.3 W/s: {search.objective:.6f} W")

# %%
# The time of the best step over its price.

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(prices, times, "o-")
axes.set(xlabel="price of time [W/s]", ylabel="time of the best step [s]")
