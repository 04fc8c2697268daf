"""Tell a sampler of Optuna about GaitBench's constraint: run it in the folder that contains `benchmarks`."""

import optuna
import optunahub

gaitbench = optunahub.load_local_module("benchmarks/gaitbench", registry_root=".")
problem = gaitbench.Problem("dsp-v5")
sampler = optuna.samplers.TPESampler(seed=0, constraints_func=lambda trial: trial.user_attrs["constraints"])
study = optuna.create_study(directions=problem.directions, sampler=sampler)


def objective(trial: optuna.Trial) -> float:
    params = {name: trial.suggest_float(name, d.low, d.high) for name, d in problem.search_space.items()}
    trial.set_user_attr("constraints", list(problem.evaluate_constraints(params).values()))
    return problem.evaluate(params)


study.optimize(objective, n_trials=100)
print(f"best feasible: {study.best_value:.4f} W, best known: {problem.instance.best_known:.4f} W")
