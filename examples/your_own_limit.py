"""
Your own limit
==============

A limit on the rate of both hips' pitch in single support, in a file of your own: it reads samples by name and returns rows.
"""

import matplotlib.pyplot as plt

import nlp_gait

# %%
# The limit: a class with parameters and rows.
from nlp_gait.limits import Limit, make_parameters, make_rows_at_samples

HIPS = ("LHipPitch", "RHipPitch")


class HipPitchRate(Limit):
    """Rate of both hips' pitch within a limit."""

    # name, unit, default, description, smallest and largest value
    parameters = make_parameters(("hip_pitch_rate_limit_rad_s", "rad/s", 3.0, "largest rate of hip pitch", 0.0, 100.0))

    def add(self, point, samples, ops):
        """Return the rows, and metrics by name."""
        limit = point["hip_pitch_rate_limit_rad_s"]
        rates = samples.qd[[samples.moving.index(joint) for joint in HIPS], :]
        return [make_rows_at_samples("hip_pitch_rate", "rad/s", rates, HIPS, -limit, limit)], {}


# %%
# The slower the hips must be, the more power a step of 0.8 s needs.

problem = nlp_gait.load("nao-ssp").with_limits(single_support=[HipPitchRate()]).fix(single_support_time_s=0.8)
limits, powers = (3.0, 1.4, 1.2, 1.1), []
for limit in limits:
    solution = nlp_gait.solve(problem.with_values(hip_pitch_rate_limit_rad_s=limit), starts=2, seed=0)
    powers.append(solution.objective)
    print(f"{limit} rad/s: {solution.objective:.4f} W, {solution.status}")

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(limits, powers, "o-")
axes.set(xlabel="largest rate of hip pitch [rad/s]", ylabel="least power [W]")
