"""
The price of lifting the foot
=============================

IPOPT follows the optimum over a variable fixed at one value after another; each solve starts from the previous solution.
`nlp-gait sweep` does the same from the command line, over one or two variables or limits.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import nlp_gait
from compare.questions.question import find
from compare.questions.sweep import Sweep, parse_axis

question = Sweep(problem=nlp_gait.load("nao-ssp"), axes=[parse_axis("swing_height_m=0.015:0.028:5")], starts=2)
points = find(question)
for point in points:
    print(f"{point.at['swing_height_m'] * 1000:.1f} mm: {point.objective:.5f} W, {point.status}")

# %%
# The points as a table and a figure in files.

print("wrote", *(path.name for path in question.report(points).write(Path())))

# %%
# Lifting the foot higher costs more for each millimetre.

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot([1000 * point.at["swing_height_m"] for point in points], [point.objective for point in points], "o-")
axes.set(xlabel="height of the swing foot [mm]", ylabel="least power [W]")
