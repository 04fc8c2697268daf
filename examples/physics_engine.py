"""
A gait in the physics engine
============================

The optimum of the model, simulated open loop in MuJoCo with NAO's drives: does the robot fall, where is the centre of
pressure, and how much power do the drives need? Needs the extra `sim`; `nlp-gait simulate` writes pages and films, too.
"""

import matplotlib.pyplot as plt

import nlp_gait
from nlp_gait.formulation import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import average_pressure, measure
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

problem = nlp_gait.load("nao-ssp")
solution = nlp_gait.solve(problem, starts=2)

# %%
# The planned motion, simulated open loop, and what was measured.

plan, drive = make_plan(Result(problem=problem, x=problem.check_x(solution.x))), Drive()
trace = simulate_plan(plan, drive=drive)
found = measure(plan, trace, drive)
print("it fell" if found.fallen else f"it stayed up, tilting by {found.largest_tilt_deg:.2f} degrees at most")
print(f"power: {found.predicted.total_W:.3f} W by the model, {found.measured.total_W:.3f} W in the engine")
print(f"centre of pressure: {1000 * found.pressure_rms_m:.1f} mm from the planned ZMP (root mean square)")

# %%
# Where the feet press in the engine, and where the model planned it.

during = trace.t <= plan.duration_s
t, pressure = trace.t[during], average_pressure(trace, drive.period_s)[during]
figure, both = plt.subplots(2, 1, figsize=(6, 4), sharex=True, layout="constrained")
for axes, k, name in zip(both, (0, 1), "xy", strict=True):
    axes.plot(t, 1000 * pressure[:, k], label="centre of pressure, engine")
    axes.plot(t, 1000 * plan.at("zmp", t)[:, k], "k", label="planned ZMP")
    axes.set_ylabel(f"{name} [mm]")
both[0].legend()
both[1].set_xlabel("time [s]")
