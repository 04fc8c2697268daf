"""
Power against stability: a front
================================

The true front between mean power and the mean balance margin to the side. Each point is an optimum with its price, the
front's slope at this point; `nlp-gait pareto` adds NSGA-II and CMOPSO.
"""

import matplotlib.pyplot as plt

import nlp_gait
from compare.questions.pareto.front import make_competing_objective, solve_front

# %%
# Five points of the front, each an optimum with another required margin.

problem = nlp_gait.load("nao-dsp")
margin = make_competing_objective("dbm_y_mean", problem)
front = solve_front(problem, margin, points=5, starts=1)
for point in front:
    print(f"{1000 * point.value:6.2f} mm: {point.power_W:.4f} W, the next millimetre for {point.price / 1000:.4f} W")

# %%
# A search approximates this line from above; no gait lies below it.

figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.plot([1000 * point.value for point in front], [point.power_W for point in front], "o-")
axes.set(xlabel="mean balance margin to the side [mm]", ylabel="mean power [W]", title=problem.title)
