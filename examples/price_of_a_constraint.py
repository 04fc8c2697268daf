"""
The price of a constraint
=========================

A gradient-based optimum has prices: the change of the least power per unit by which a limit is raised. Here the price of the
required balance margin at one limit is drawn as a slope, together with optima solved at other limits.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlp_gait

problem = nlp_gait.load("nao-ssp")
here = problem.value("dbm_y_mean_limit_m")
optimum = nlp_gait.solve(problem, starts=3)
(price,) = (a.price for a in optimum.active_constraints if a.name == "dbm_y_mean")
print(f"at {1000 * here:g} mm: {optimum.objective:.6f} W, and {price / 1000:.5f} W per millimetre")

# %%
# Optima at other limits, each from the first one, and one 0.1 mm away: its difference quotient is the price.

limits = np.linspace(0.016, 0.024, 9)
powers = [
    nlp_gait.solve(problem.with_values(dbm_y_mean_limit_m=limit), starts=1, x0=optimum.x).objective for limit in limits
]
step = 1e-4
nearby = nlp_gait.solve(problem.with_values(dbm_y_mean_limit_m=here + step), starts=1, x0=optimum.x)
print(f"by solving again {1000 * step:g} mm away: {(nearby.objective - optimum.objective) / step / 1000:.5f} W per mm")

# %%
# The price is the slope of the solved points.

figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot(1000 * limits, powers, "o", label="solved")
axes.plot(1000 * limits, optimum.objective + price * (limits - here), "-", label="price at 20 mm")
axes.set(xlabel="demanded mean margin to the side [mm]", ylabel="least power [W]")
axes.legend()
