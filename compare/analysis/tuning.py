"""Settings of searches, tuned on other problems or runs than those that are judged: ``compare --tune``, ``bench --tune``.

Each trial runs a search on every training problem, with settings that Optuna's tree-structured Parzen estimator proposes; the
first trial has the search's own. What counts is the area under the convergence curve, see ``compare.analysis.anytime``.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from compare.analysis.anytime import compute_area
from compare.analysis.comparison import DEFAULT_WEIGHTING, read_objective
from compare.analysis.record_statistics import find_best_known, make_curve
from compare.study.record import RunRecord
from compare.study.references import find_reference
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
BATCH = 5  # trials that run at once
TRAINING_SEED = 9_000_000  # first one, of instances and of runs
DIGITS = 4


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """How a search's settings were tuned."""

    solver: str  #: its name in the study without tuning
    settings: Mapping[str, Any]  #: chosen
    training: tuple[str, ...]  #: problems, each with one run
    trials: int  #: the first with the settings before
    evaluations: int  #: of all its runs together
    time_s: float  #: wall time of all runs, as if one after the other
    area: tuple[float, float]  #: mean over the training problems before tuning, and of the chosen settings, from 0 to 1


def choose_training(problems: Sequence[ProblemSpec]) -> tuple[ProblemSpec, ...]:
    """Return the problems to train on: instances of the same families with training seeds, else the problems themselves.

    Runs have seeds of training in any case, so no run that is judged was seen.
    """
    families = [find_family(str(spec.options.get("instance", spec.address))) for spec in problems]
    chosen: dict[str, ProblemSpec] = {}
    for number in range(INSTANCES):
        for spec, family in zip(problems, families, strict=True):
            own = ProblemSpec(name=make_id(family, TRAINING_SEED + number)) if family else spec
            chosen.setdefault(own.title, own)
    return tuple(chosen.values())[:INSTANCES]


def tune_solvers(
    study: Study, settings: StudySettings, trials: int, progress: Callable[[str], None]
) -> tuple[StudySettings, list[Tuning]]:
    """Tune every search of a study; return its settings with a solver ``NAME-tuned`` after each, and how they were tuned.

    Args:
        study: its folder, in whose ``tuning`` the runs are stored, its jobs and scheduler.
        settings: of the study.
        trials: of each search.
        progress: called with a sentence on each search.

    Raises:
        MissingExtraError: Optuna is not installed.
        InputError: no search has ranges.
        Interrupted: Ctrl-C; finished runs are stored, and the same call continues.
    """
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
        tuning = _tune(study, training, replace(solver, label=task.title, runs=1, polish=False), ranges, trials)
        tunings.append(tuning)
        before, after = tuning.area
        progress(f"{task.title}: area under the curve {before:.3f}, {after:.3f} with {describe_choice(tuning)}")
        if tuning.settings:
            own = {**solver.settings, **tuning.settings}
            solvers.append(replace(solver, settings=own, label=f"{task.title}-tuned"))
    if not tunings:
        raise InputError(
            "no solver of this study has settings with ranges; docs/bring-your-own.md says how to give them"
        )
    return replace(settings, solvers=tuple(solvers)), tunings


def describe_choice(tuning: Tuning) -> str:
    """Return the chosen settings in words."""
    return ", ".join(f"{name} = {value}" for name, value in tuning.settings.items()) or "the same settings"


def _tune(
    study: Study, training: StudySettings, solver: SolverSpec, ranges: Mapping[str, Range], trials: int
) -> Tuning:
    optuna = _import_optuna()
    search = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=training.seed))
    made = Task(problem=training.problems[0], solver=solver.name, settings=solver.settings).make_search()
    defaults = {name: getattr(made, name) for name in ranges if hasattr(made, name)}
    known = len(defaults) == len(ranges) and all(_contains(within, defaults[name]) for name, within in ranges.items())
    if known:
        search.enqueue_trial(defaults)
    proposals: list[dict[str, Any]] = []
    areas: list[float] = []
    records: list[RunRecord] = []
    for first in range(0, trials, BATCH):
        asked = [search.ask() for _ in range(first, min(first + BATCH, trials))]
        proposed = [_propose(trial, ranges) for trial in asked]
        if not first:
            proposed[0] = {}
        specs = tuple(
            replace(solver, settings={**solver.settings, **settings}, label=f"{solver.label}-trial{k}")
            for k, settings in enumerate(proposed, start=first)
        )
        folder = None if study.folder is None else study.folder / FOLDER
        found = run_study(replace(study, tasks=replace(training, solvers=specs).tasks(), folder=folder))
        records += found
        proposals += proposed
        by_label = {spec.label: [record for record in found if record.solver == spec.label] for spec in specs}
        areas += [compute_mean_area(runs, records, training.stop.evaluations) for runs in by_label.values()]
        for trial, area in zip(asked, areas[first:], strict=True):
            if known or trial.number:
                search.tell(trial, area)
            else:  # its proposal was not what ran
                search.tell(trial, state=optuna.trial.TrialState.FAIL)
    best = max(range(trials), key=areas.__getitem__)
    return Tuning(
        solver=solver.label,
        settings={name: value for name, value in proposals[best].items() if value != defaults.get(name)},
        training=tuple(problem.title for problem in training.problems),
        trials=trials,
        evaluations=sum(record.history.evaluations[-1] for record in records if record.history.evaluations),
        time_s=sum(record.time_s.solve for record in records),
        area=(areas[0], areas[best]),
    )


def compute_mean_area(runs: Sequence[RunRecord], records: Sequence[RunRecord], budget: int) -> float:
    """Return the mean area over the convergence curve of runs; gaps are from the best known value, else the best of records."""
    areas = []
    for run in runs:
        objective, known = read_objective(run), find_reference(run.definition["problem"]).objective
        alike = [record for record in records if record.problem == run.problem]
        reference = find_best_known(alike, objective) if known is None else known
        areas.append(compute_area(make_curve(run, objective, reference, DEFAULT_WEIGHTING), budget))
    return sum(areas) / len(areas)


def _propose(trial: Any, ranges: Mapping[str, Range]) -> dict[str, Any]:
    """Return a trial's settings; whole numbers between whole ends, others with four digits."""
    chosen: dict[str, Any] = {}
    for name, within in ranges.items():
        low, high, *scale = within
        if isinstance(low, str):
            chosen[name] = trial.suggest_categorical(name, within)
        elif isinstance(low, int) and isinstance(high, int):
            chosen[name] = trial.suggest_int(name, low, high, log=bool(scale))
        else:
            value = trial.suggest_float(name, low, high, log=bool(scale))
            chosen[name] = min(max(float(f"{value:.{DIGITS}g}"), low), high)
    return chosen


def _contains(within: Range, value: Any) -> bool:
    return value in within if isinstance(within[0], str) else bool(within[0] <= value <= within[1])


def _import_optuna() -> Any:
    """Return Optuna, silent; raises MissingExtraError if it is not installed."""
    try:
        import optuna
    except ImportError:
        raise MissingExtraError("tuning needs Optuna: pip install 'nlp-gait[tune]'") from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


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
