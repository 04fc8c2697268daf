"""Tuning of searches by Optuna, on other problems or seeds than those that are judged: ``compare --tune``, ``bench --tune``."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import ECDF_TARGETS, Curve
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import GRADIENT_SOLVERS, ProblemSpec, Task
from metaheuristics.settings import Range, list_ranges
from nlp_gait.errors import InputError, MissingExtraError
from nlp_gait.gaitbench.generated import find_family, make_id

FOLDER = "tuning"
INSTANCES = 4  # to train on, of all problems together
TRAINING_SEED = 9_000_000  # first one, of instances and of runs


def choose_training(problems: Sequence[ProblemSpec]) -> tuple[ProblemSpec, ...]:
    """Return instances of the same families with seeds of training, or the problems themselves: runs have such seeds, too."""
    families = [find_family(str(spec.options.get("instance", spec.address))) for spec in problems]
    chosen: dict[str, ProblemSpec] = {}
    for number in range(INSTANCES):
        for spec, family in zip(problems, families, strict=True):
            training = ProblemSpec(name=make_id(family, TRAINING_SEED + number)) if family else spec
            chosen.setdefault(training.title, training)
    return tuple(chosen.values())[:INSTANCES]


def tune_solvers(study: Study, settings: StudySettings, trials: int, progress: Callable[[str], None]) -> StudySettings:
    """Return the settings of a study with a solver ``NAME-tuned`` after each search that has ranges and gains from tuning.

    The runs are stored in the folder ``tuning`` of the study, so that the same call continues after Ctrl-C.

    Raises:
        MissingExtraError: Optuna is not installed.
        InputError: no search has ranges.
        Interrupted: by Ctrl-C.
    """
    training_study = replace(study, folder=None if study.folder is None else study.folder / FOLDER)
    training = replace(settings, problems=choose_training(settings.problems), runs=1, seed=TRAINING_SEED)
    solvers: list[SolverSpec] = []
    tunable = False
    for solver in settings.solvers:
        solvers.append(solver)
        task = Task(problem=training.problems[0], solver=solver.name, settings=solver.settings, label=solver.label)
        ranges = {} if solver.name in GRADIENT_SOLVERS else list_ranges(task.make_search())
        ranges = {name: limits for name, limits in ranges.items() if name not in solver.settings}
        if not ranges:
            progress(f"{task.title} has no settings to tune")
            continue
        tunable = True
        untuned = replace(solver, label=task.title, runs=1, polish=False)
        chosen, area = _tune(training_study, training, untuned, ranges, trials)
        words = ", ".join(f"{k} = {f'{v:.4g}' if isinstance(v, float) else v}" for k, v in chosen.items())
        progress(f"{task.title}: area under the curve {area:.3f} with {words or 'the settings before'}")
        if chosen:
            solvers.append(replace(solver, settings={**solver.settings, **chosen}, label=f"{task.title}-tuned"))
    if not tunable:
        raise InputError("no solver of this study has settings with ranges; docs/researcher.md says how to give them")
    return replace(settings, solvers=tuple(solvers))


def _tune(
    study: Study, training: StudySettings, solver: SolverSpec, ranges: Mapping[str, Range], trials: int
) -> tuple[dict[str, Any], float]:
    """Return the settings with the largest mean area over the convergence curves, empty for the settings before, and the area."""
    try:
        import optuna
    except ImportError:
        raise MissingExtraError("tuning needs Optuna: pip install 'nlp-gait[algorithms]'") from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    records: list[RunRecord] = []  # of all trials: without a shipped best known value, gaps are from the best of them

    def measure(label: str, settings: Mapping[str, Any]) -> float:
        spec = replace(solver, settings={**solver.settings, **settings}, label=label)
        records.extend(run_study(replace(study, tasks=replace(training, solvers=(spec,)).tasks())))
        curves = [curve for c in compare_problems(records) for s in c.solvers if s.name == label for curve in s.curves]
        return float(np.mean([compute_area(curve, training.stop.evaluations) for curve in curves]))

    search = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=training.seed))
    search.optimize(lambda t: measure(f"{solver.label}-trial{t.number + 1}", _propose(t, ranges)), n_trials=trials)
    before, best = measure(solver.label, {}), search.best_trial
    return (best.params, best.value) if best.value > before else ({}, before)


def _propose(trial: Any, ranges: Mapping[str, Range]) -> dict[str, Any]:
    """Return a trial's settings; whole numbers between whole ends."""
    chosen: dict[str, Any] = {}
    for name, (low, high, *log) in ranges.items():
        if isinstance(low, str):
            chosen[name] = trial.suggest_categorical(name, ranges[name])
        elif isinstance(low, int) and isinstance(high, int):
            chosen[name] = trial.suggest_int(name, low, high, log=bool(log))
        else:
            chosen[name] = trial.suggest_float(name, low, high, log=bool(log))
    return chosen


def compute_area(curve: Curve, budget: float) -> float:
    """Return the area over a run's convergence curve: mean over the budget of log(gap), from 100 % (0) to 1e-6 (1), clipped.

    Source:
        Van Stein, Bäck (2024), LLaMEA, section 4 (AOCC); here of relative gaps, and of the targets of the distributions.
    """
    steps = np.append(np.clip(curve.evaluations, 0.0, budget), budget)
    logs = np.log10(np.clip(np.nan_to_num(curve.gap, nan=np.inf), ECDF_TARGETS[-1], ECDF_TARGETS[0]))
    return float(np.sum(np.diff(steps) * logs / np.log10(ECDF_TARGETS[-1])) / budget)
