"""
Any CasADi function, for batches
================================

No gait here: a pole is swung up by pushing its cart. A rollout of 60 steps is written once in CasADi and compiled by
``compile_function``, which evaluates many plans at once. A search draws 4000 plans around the best ones, 30 times; then steps
along the compiled gradient improve the plan further.
"""

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

import nlp_gait

STEPS, STEP_S = 60, 0.03
force = ca.SX.sym("force", STEPS)
position, angle, speed, rate = 0.0, ca.SX(np.pi), 0.0, 0.0  # the pole hangs down
angles, cost = [angle], 0.0
for k in range(STEPS):
    s, c = ca.sin(angle), ca.cos(angle)
    push = (force[k] + 0.05 * rate**2 * s) / 1.1
    turn = (9.81 * s - c * push) / (0.5 * (4 / 3 - 0.1 * c**2 / 1.1))
    speed = speed + STEP_S * (push - 0.05 * turn * c / 1.1)
    rate, position = rate + STEP_S * turn, position + STEP_S * speed
    angle = angle + STEP_S * rate
    angles.append(angle)
    cost = cost + STEP_S * (1 - ca.cos(angle) + 0.1 * position**2 + 1e-3 * force[k] ** 2 + 0.01 * rate**2)
rollout = ca.Function("rollout", [force], [cost, ca.vertcat(*angles)], ["force"], ["cost", "angles"])

# %%
# The compiled function and its gradient accept one plan or many.

evaluate = nlp_gait.compile_function(rollout)
gradient = evaluate.jacobian("cost", "force")
print(evaluate.argument_shapes, evaluate.result_shapes, gradient.result_shapes)

# %%
# A search over plans: sample, keep the best 1 %, sample around their mean. Then 300 steps along the gradient.

rng = np.random.default_rng(0)
plan, history = np.zeros(STEPS), []
for width in np.geomspace(10.0, 1.0, 30):
    plans = plan + width * rng.normal(size=(4000, STEPS))
    costs, _ = evaluate(plans)  # (4000,)
    plan = plans[np.argsort(costs)[:40]].mean(axis=0)
    history.append(costs.min())
sampled, _ = evaluate(plan)  # one plan has no first axis, and neither have its results
for _ in range(300):
    slope = gradient(plan)
    trials = plan - np.geomspace(1e-3, 100.0, 40)[:, None] * slope  # 40 step lengths at once
    plan = trials[np.argmin(evaluate(trials)[0])]
final, swing = evaluate(plan)
print(
    f"cost {rollout(np.zeros(STEPS))[0].full().item():.2f} without a push, {sampled:.4f} sampled, {final:.4f} with the gradient"
)

# %%
# The pole ends upright.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
left.plot(history)
left.set(xlabel="iteration", ylabel="lowest cost of 4000 plans")
right.plot(np.arange(STEPS + 1) * STEP_S, np.degrees(swing))
right.set(xlabel="time in s", ylabel="angle of the pole in degrees, 0 is up")
figure.savefig("swing.png", dpi=150)
