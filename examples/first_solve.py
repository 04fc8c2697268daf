"""
First solve
===========

IPOPT finds the cheapest step of NAO from three random starts. The active constraints are listed with their prices, and the
gait is drawn: stick figures from the side, the mechanical power, and the distance of the zero-moment point from the sole's edge.
"""

import nlp_gait

solution = nlp_gait.solve("nao-ssp", starts=3, seed=0)
goal = solution.problem.objective
print(f"{goal.name} {solution.objective:.6f} {goal.unit}, {solution.status}")

# %%
# Each active constraint has a price: the change of the least power per unit by which its bound is raised.

for bound in solution.active_constraints:
    print(f"  limited by {bound.name} at {bound.bound:g} {bound.unit}: {bound.price:.4g} {bound.price_unit}")

# %%
# The gait: from blue (left) and orange (right) poses to curves over time, also as a file.

figure = solution.plot()
figure.savefig("gait.png", dpi=150)
figure
