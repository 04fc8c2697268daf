"""Search for a gait with Optuna: run it in the folder that contains `benchmarks`."""

import optuna
import optunahub

gaitbench = optunahub.load_local_module("benchmarks/gaitbench", registry_root=".")
problem = gaitbench.Problem("dsp-v5")
study = optuna.create_study(directions=problem.directions, sampler=optuna.samplers.TPESampler(seed=0))
study.optimize(problem, n_trials=100)
print(f"best feasible: {study.best_value:.4f} W, best known: {problem.instance.best_known:.4f} W")
