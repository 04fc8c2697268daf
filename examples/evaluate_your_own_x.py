"""
Judge your own point
====================

The exact functions evaluate any candidate, here the point that a paper reports for NAO's single support: at the problem's
samples, and on a dense grid, which shows violations between them.
"""

import matplotlib.pyplot as plt

import nlp_gait
from compare import evaluate

x = [0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0]
problem = nlp_gait.load("nao-ssp", robot="nao-v5")
verdict = evaluate(problem, x)
objective = verdict.objective
print(f"{objective['name']} {objective['value']:.6f} {objective['unit']}, feasible: {verdict.feasible}")
for name, value in verdict.metrics.items():
    print(f"  {name}: {value:.6f} on its samples, {verdict.dense[name]:.6f} on {verdict.dense_intervals} intervals")

# %%
# A hip that is too high is infeasible; the violated rows are named, worst first.

too_high = evaluate(problem, [0.36, *x[1:]])
print("with the hip at 0.36 m:", *(f"\n  {row.name} by {row.violation:.3g}" for row in too_high.violations[:3]))

# %%
# The power of the same point over the height of the hip.

heights = [0.27 + 0.005 * k for k in range(9)]
powers = [evaluate(problem, [height, *x[1:]]).objective["value"] for height in heights]
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(heights, powers, "o-")
axes.set(xlabel="hip height [m]", ylabel="power [W]", title="The paper's point with another hip height")
