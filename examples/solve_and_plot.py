"""Solve a gait problem and plot its joint torques.

python examples/solve_and_plot.py [FOLDER]
"""

import sys
from pathlib import Path

import nlp_gait
from compare.drawing.figures import new_figure, save, style

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
problem = nlp_gait.load("nao-ssp")
solution = nlp_gait.solve(problem, starts=3, seed=0)
print(f"{solution.objective_name} {solution.objective:.6f} {solution.objective_unit}, {solution.status}")
for bound in solution.active_constraints:
    print(f"  held back by {bound.name} at {bound.bound:g} {bound.unit}: {bound.price:.4g} {bound.price_unit}")

signals = problem.signals(solution.x)
with style():
    figure = new_figure()
    axes = figure.subplots()
    for joint, torque in zip(signals.joints, signals.arrays["tau"].T, strict=True):
        if joint in ("LHipPitch", "LKneePitch", "LAnklePitch"):
            axes.plot(signals.arrays["t"], torque, label=joint)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("torque [Nm]")
    axes.legend()
print("wrote", *save(figure, folder / "torques"))
