"""Tuning of searches by Optuna, on other problems or seeds than those that are judged: ``compare --tune``, ``bench --tune``."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import ECDF_TARGETS, Curve
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import GRADIENT_SOLVERS, ProblemSpec, Task
from metaheuristics.settings import Range, list_ranges
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError, MissingExtraError
from nlp_gait.files import convert_errors, read_json, write_json
from nlp_gait.gaitbench.generated import find_family, make_id

FILE, FOLDER = "tuning.json", "tuning"
INSTANCES = 4  # to train on, of all problems together
TRAINING_SEED = 9_000_000  # first one, of instances and of runs


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """How a search's settings were tuned."""

    solver: str  #: its name in the study without tuning
    settings: Mapping[str, Any]  #: chosen; empty if no trial was better than the settings before
    training: tuple[str, ...]  #: problems, each with one run
    trials: int  #: next to the settings before
    evaluations: int  #: of all its runs together
    time_s: float  #: wall time of all runs, as if one after the other
    area: tuple[float, float]  #: mean over the training problems before tuning, and of the chosen settings, from 0 to 1


def choose_training(problems: Sequence[ProblemSpec]) -> tuple[ProblemSpec, ...]:
    """Return instances of the same families with seeds of training, or the problems themselves: runs have such seeds, too."""
    families = [find_family(str(spec.options.get("instance", spec.address))) for spec in problems]
    chosen: dict[str, ProblemSpec] = {}
    for number in range(INSTANCES):
        for spec, family in zip(problems, families, strict=True):
            training = ProblemSpec(name=make_id(family, TRAINING_SEED + number)) if family else spec
            chosen.setdefault(training.title, training)
    return tuple(chosen.values())[:INSTANCES]


def tune_solvers(
    study: Study, settings: StudySettings, trials: int, progress: Callable[[str], None]
) -> tuple[StudySettings, list[Tuning]]:
    """Return the settings of a study with a solver ``NAME-tuned`` after each search that has ranges, and how it was tuned.

    The runs are stored in the folder ``tuning`` of the study, so that the same call continues after Ctrl-C.

    Raises:
        MissingExtraError: Optuna is not installed.
        InputError: no search has ranges.
        Interrupted: by Ctrl-C.
    """
    folder = None if study.folder is None else study.folder / FOLDER
    training = replace(settings, problems=choose_training(settings.problems), runs=1, seed=TRAINING_SEED)
    solvers: list[SolverSpec] = []
    tunings: list[Tuning] = []
    for solver in settings.solvers:
        solvers.append(solver)
        task = Task(problem=training.problems[0], solver=solver.name, settings=solver.settings, label=solver.label)
        ranges = {} if solver.name in GRADIENT_SOLVERS else list_ranges(task.make_search())
        ranges = {name: within for name, within in ranges.items() if name not in solver.settings}
        if not ranges:
            progress(f"{task.title} has no settings to tune")
            continue
        before = replace(solver, label=task.title, runs=1, polish=False)
        tuning = _tune(replace(study, folder=folder), training, before, ranges, trials)
        tunings.append(tuning)
        progress(
            f"{task.title}: area under the curve {tuning.area[0]:.3f}, {tuning.area[1]:.3f} with {describe_choice(tuning)}"
        )
        if tuning.settings:
            tuned = {**solver.settings, **tuning.settings}
            solvers.append(replace(solver, settings=tuned, label=f"{task.title}-tuned"))
    if not tunings:
        raise InputError(
            "no solver of this study has settings with ranges; docs/bring-your-own.md says how to give them"
        )
    return replace(settings, solvers=tuple(solvers)), tunings


def _tune(
    study: Study, training: StudySettings, solver: SolverSpec, ranges: Mapping[str, Range], trials: int
) -> Tuning:
    """Maximise the mean area over the convergence curves on the training problems."""
    try:
        import optuna
    except ImportError:
        raise MissingExtraError("tuning needs Optuna: pip install 'nlp-gait[algorithms]'") from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    records: list[RunRecord] = []

    def measure(label: str, settings: Mapping[str, Any]) -> float:
        spec = replace(solver, settings={**solver.settings, **settings}, label=label)
        records.extend(run_study(replace(study, tasks=replace(training, solvers=(spec,)).tasks())))
        runs = [s for comparison in compare_problems(records) for s in comparison.solvers if s.name == label]
        return float(np.mean([compute_area(curve, training.stop.evaluations) for s in runs for curve in s.curves]))

    search = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=training.seed))
    search.optimize(lambda t: measure(f"{solver.label}-trial{t.number + 1}", _propose(t, ranges)), n_trials=trials)
    before, best = measure(solver.label, {}), search.best_trial
    return Tuning(
        solver=solver.label,
        settings=best.params if best.value > before else {},
        training=tuple(problem.title for problem in training.problems),
        trials=trials,
        evaluations=sum(record.history.evaluations[-1] for record in records if record.history.evaluations),
        time_s=sum(record.time_s.solve for record in records),
        area=(before, max(before, best.value)),
    )


def _propose(trial: Any, ranges: Mapping[str, Range]) -> dict[str, Any]:
    """Return a trial's settings; whole numbers between whole ends."""
    chosen: dict[str, Any] = {}
    for name, (low, high, *rest) in ranges.items():
        if isinstance(low, str):
            chosen[name] = trial.suggest_categorical(name, ranges[name])
        elif isinstance(low, int) and isinstance(high, int):
            chosen[name] = trial.suggest_int(name, low, high, log=bool(rest))
        else:
            chosen[name] = trial.suggest_float(name, low, high, log=bool(rest))
    return chosen


def compute_area(curve: Curve, budget: float) -> float:
    """Return the area over a run's convergence curve: mean over the budget of log(gap), from 100 % (0) to 1e-6 (1), clipped.

    Source:
        Van Stein, Bäck (2024), LLaMEA, section 4 (AOCC); here of relative gaps, and of the targets of the distributions.
    """
    steps = np.append(np.clip(curve.evaluations, 0.0, budget), budget)
    logs = np.log10(np.clip(np.nan_to_num(curve.gap, nan=np.inf), ECDF_TARGETS[-1], ECDF_TARGETS[0]))
    return float(np.sum(np.diff(steps) * logs / np.log10(ECDF_TARGETS[-1])) / budget)


def describe_choice(tuning: Tuning) -> str:
    """Return the chosen settings in words."""
    values = {k: f"{value:.4g}" if isinstance(value, float) else value for k, value in tuning.settings.items()}
    return ", ".join(f"{name} = {value}" for name, value in values.items()) or "the same settings"


def write_tunings(folder: Path, tunings: Sequence[Tuning]) -> None:
    """Write how searches were tuned into the folder of their study."""
    write_json(folder / FILE, [asdict(tuning) for tuning in tunings])


def read_tunings(folder: Path) -> tuple[Tuning, ...]:
    """Return how the searches of a study were tuned, none if they were not; raises InputError for a damaged file."""
    path = folder / FILE
    if not path.is_file():
        return ()
    with convert_errors(f"tuning {str(path)!r}", InputError):
        return tuple(decode(Tuning, entry, FILE) for entry in read_json(path, "tuning"))
