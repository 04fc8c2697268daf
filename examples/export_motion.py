"""
Exporting a motion
==================

A gait as files for other programs: Webots' `.motion`, CSV with every time history, NAOqi's set-points. The CSV can be read back:
`nlp-gait evaluate --motion gait.csv` judges it, like any other motion.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import nlp_gait
from nlp_gait.export.formats import FORMATS, write_as
from nlp_gait.formulation import Result, sample_at_period

problem = nlp_gait.load("nao-ssp")
solution = nlp_gait.solve(problem, starts=2)
gait = Result(problem=problem, x=problem.check_x(solution.x))

# %%
# One file in each format, sampled every 40 ms.

for name in ("webots", "csv", "naoqi"):
    path = Path(f"gait{FORMATS[name]}")
    write_as(name, path, gait, period_ms=40)
    print(f"{path.name}: {len(path.read_text().splitlines())} lines")
print(Path("gait.motion").read_text()[:180], "...")

# %%
# The same set-points as arrays.

signals = sample_at_period(gait, period_ms=40)
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
for joint in ("RHipPitch", "RKneePitch", "RAnklePitch"):
    axes.plot(signals["t"], signals[f"q {joint}"], label=joint)
axes.set(xlabel="time [s]", ylabel="set-point [rad]", title="The swinging leg")
axes.legend()
