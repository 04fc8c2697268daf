"""
Move a limit, see the optimum
=============================

A solve takes about 0.2 s: fast enough for a slider. `with_values` changes a number of a problem without building it again, so the
optimum follows the slider. Needs ipywidgets; the slider moves in Jupyter.
"""

import matplotlib.pyplot as plt
from ipywidgets import FloatSlider, interact

import nlp_gait

problem = nlp_gait.load("nao-ssp")
first = nlp_gait.solve(problem, starts=3)
solved = {}

# %%
# One solve, from the first optimum, and everything solved so far as a curve.


def solve_at(margin_mm):
    """Solve with another required mean margin to the side, and draw all optima so far."""
    changed = problem.with_values(dbm_y_mean_limit_m=margin_mm / 1000)
    solution = nlp_gait.solve(changed, starts=1, x0=first.x)
    solved[margin_mm] = solution.objective
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    axes.plot(*zip(*sorted(solved.items()), strict=True), "o-")
    axes.plot(margin_mm, solution.objective, "o", ms=10)
    axes.set(xlabel="required mean margin to the side [mm]", ylabel="least power [W]",
             title=f"{solution.objective:.4f} W, a step of {solution.x['single_support_time_s']:.3f} s")  # fmt: skip
    plt.close(figure)  # shown as the value of the cell
    return figure


for margin_mm in (16.0, 18.0):
    solve_at(margin_mm)
figure = solve_at(20.0)
figure

# %%
# In Jupyter: drag, and release.

interact(solve_at, margin_mm=FloatSlider(min=14, max=24, step=0.5, value=20, continuous_update=False))
