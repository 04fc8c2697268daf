"""Verification of a study: evaluate all points, repeat the runs, and list what differs, is missing, or was not repeated."""

import itertools
import json
import math
import random
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from compare.study.pack import find_packed, list_problem_code, read_index
from compare.study.record import RunRecord, group_by, list_versions
from compare.study.references import SAME_VALUE
from compare.study.run import EVALUATIONS, ProblemSpec, Run, list_solvers
from compare.study.study import FILE, RECORDS, Study, read_each, read_study_file, run_study
from nlp_gait.backends.exact import build_exact_model, describe_difference, hash_json, identify_problem
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation.added_limits import split_names
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.solution import StoredProblem
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import resolve_code

# Fields in which a repeated run may differ from its record.
NOT_REPEATED = ("problem", "solver", "run", "inputs", "time_s", "versions")
ALTERED = 0.1  # share of altered runs whose chance to pass is printed


class Difference(NamedTuple):
    """A row of the table: a record or a file, and what is the matter with it."""

    what: str
    kind: str  #: "differs", "missing" or "not repeated"
    why: str


class Verification(NamedTuple):
    """Result of a verification."""

    rows: list[Difference]
    records: list[RunRecord]  #: that could be read
    repeated: int  #: runs
    evaluated: int  #: points

    @property
    def holds(self) -> bool:
        """Whether something was checked, nothing differs and nothing is missing."""
        return self.is_checked and all(row.kind == "not repeated" for row in self.rows)

    @property
    def is_checked(self) -> bool:
        """Whether a point was evaluated or a run repeated, or there are none."""
        return not self.records or bool(self.evaluated + self.repeated)

    @property
    def sentence(self) -> str:
        """The result in words, with the chance that altered runs were not among the repeated ones."""
        total = len(self.records)
        if not self.is_checked:
            return "no run was checked, for the reasons above"
        result = "nothing differs" if self.holds else "the table names what differs or is missing"
        points = f"{self.evaluated} point{'s' * (self.evaluated != 1)}"
        text = f"{points} evaluated and {self.repeated} of {total} runs repeated: {result}"
        if self.repeated == total or not total:
            return text
        chance = compute_chance(total, self.repeated)
        return f"{text}; a study in which {100 * ALTERED:.0f} % of the runs are altered would pass with probability {chance:.2g}"


def compute_chance(total: int, repeated: int, share: float = ALTERED) -> float:
    """Return the probability that none of the altered runs, a share of all, is among the repeated ones."""
    altered = max(1, int(share * total))
    return math.comb(total - altered, repeated) / math.comb(total, repeated)


def verify_study(
    folder: Path,
    *,
    share: float = 1.0,
    run_code: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Verification:
    """Evaluate every point of a study again, repeat a share of its runs, drawn at random, and compare.

    Args:
        folder: of a study, or of an unpacked archive.
        share: of the runs that are repeated, from 0 to 1.
        run_code: whether user code that is packed in the folder may run; other user code runs if the command has named it.
        progress: called with the number of repeated runs and of all that will be.

    Raises InputError if there are no records.
    """
    read = read_each(folder)
    records = [record for _, record in read if isinstance(record, RunRecord)]
    damaged = [(path, error) for path, error in read if isinstance(error, InputError)]
    rows = [Difference(path.relative_to(folder).as_posix(), "differs", str(error)) for path, error in damaged]
    rows += _check_records(folder, records)
    repeated, evaluated = list[tuple[RunRecord, Run]](), 0
    for group in group_by(records, lambda record: hash_json(record.inputs.problem)).values():
        try:
            spec = _locate_problem(folder, group[0], run_code)
            rows += list(_check_points(spec, group))
        except (GaitError, ValueError) as error:
            rows += [Difference(r.name, "not repeated", f"its problem cannot be made: {error}") for r in group]
            continue
        evaluated += sum(bool(record.x) for record in group)
        for record in group:
            try:
                repeated.append((record, _make_run(folder, record, spec, run_code)))
            except (GaitError, ValueError) as error:
                rows.append(Difference(record.name, "not repeated", str(error)))
    random.SystemRandom().shuffle(repeated)  # the drawn ones cannot be predicted
    repeated = repeated[: math.ceil(share * len(repeated))]
    rows += _repeat(repeated, progress)
    return Verification(_fold(rows), records, len(repeated), evaluated)


def _fold(rows: Sequence[Difference]) -> list[Difference]:
    """Return one row for all with the same reason."""
    folded = []
    for (kind, why), group in group_by(rows, lambda row: (row.kind, row.why)).items():
        others = f" and {len(group) - 1} more" if len(group) > 1 else ""
        folded.append(Difference(f"{group[0].what}{others}", kind, why))
    return sorted(folded, key=lambda row: row.kind == "not repeated")


def _check_records(folder: Path, records: Sequence[RunRecord]) -> Iterator[Difference]:
    """Yield planned runs without a record, records under another's name, and versions that are not this machine's."""
    for name in read_study_file(folder).runs:
        if not (folder / RECORDS / f"{name}.json").exists():
            yield Difference(f"{RECORDS}/{name}.json", "missing", f"{FILE} lists it")
    for record in records:
        problem, solver = record.inputs.problem["name"], record.inputs.solver
        for label, own, names in ((record.problem, problem, PROBLEMS), (record.solver, solver, list_solvers())):
            if label in names and label != own:
                yield Difference(record.name, "differs", f"it is named {label!r}, but its inputs are those of {own!r}")
    here = list_versions()
    for name in ("nlp-gait", "casadi"):
        others = {str(record.versions.get(name, here[name])) for record in records} - {here[name]}
        if others:
            words = f"computed by version {', '.join(sorted(others))}; here {here[name]}"
            yield Difference(name, "not repeated", words)


def _locate_problem(folder: Path, record: RunRecord, run_code: bool) -> ProblemSpec:
    """Return the problem of a record, from files in the folder or from code that the command has named."""
    stored, index = decode(StoredProblem, record.inputs.problem, "problem"), read_index(folder)
    packed, options = find_packed(folder, list_problem_code(record.inputs.problem), run_code), dict(stored.options)
    if limits := split_names(str(options.get("limits", ""))):
        options["limits"] = ",".join(phase + packed.get(limit, limit) for phase, limit in limits)
    if (robot := stored.files.get("robot", "")) in index:
        _, mark, changes = str(options["robot"]).partition("@")
        options["robot"] = f"{folder / index[robot]}{mark}{changes}"
    name, options = resolve_stored(packed.get(stored.name, stored.name), options, "the run")
    return ProblemSpec(name=name, options=options, values=stored.parameters, label=record.problem)


def _check_points(spec: ProblemSpec, records: Sequence[RunRecord]) -> Iterator[Difference]:
    """Yield what does not follow from the points of records with one problem."""
    problem = spec.load()
    difference = describe_difference(records[0].inputs.problem, identify_problem(problem))
    model, sign = build_exact_model(problem), problem.objective.sign
    for record in records:
        if difference:
            yield Difference(record.name, "differs", f"its problem is another one here: {difference}")
        if not record.x:
            continue  # repeated, it has no point either
        try:
            values = model.at(problem.check_x(record.x), problem.p)
        except InputError as error:
            yield Difference(record.name, "differs", str(error))
            continue
        stated = {"objective": record.objective, "violation": record.violation, **record.metrics}
        computed = {"objective": sign * values.cost, "violation": values.violation, **values.metrics}
        for name in {**stated, **computed}:
            a, b = stated.get(name, math.nan), computed.get(name, math.nan)
            if not is_same(a, b, 0.0 if name == "objective" else 1.0):
                yield Difference(record.name, "differs", f"its {name} is {a:.9g}, but that of its x is {b:.9g}")
        if record.feasible != values.feasible:
            word = "feasible" if record.feasible else "infeasible"
            why = f"it is called {word}, and its violation is {values.violation:.3g}"
            yield Difference(record.name, "differs", why)


def is_same(a: float, b: float, scale: float = 0.0) -> bool:
    """Return whether two numbers agree to nine digits; numbers that are not finite agree with each other."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return not (math.isfinite(a) or math.isfinite(b))
    return abs(a - b) <= SAME_VALUE * max(abs(a), abs(b), scale)


def _make_run(folder: Path, record: RunRecord, spec: ProblemSpec, run_code: bool) -> Run:
    """Return the run of a record; raises InputError that says why it cannot be repeated here."""
    inputs, solver = record.inputs, record.inputs.solver
    if inputs.imported:
        raise InputError("it was imported: its counts, history and seed are as reported")
    if not isinstance(solver, str):
        raise InputError("its solver was an object of Python, which has no name")
    if inputs.time_limit_s is not None:
        raise InputError("it ended by the clock, or could have")
    if inputs.code:
        packed = find_packed(folder, [(solver, "algorithm", inputs.code)], run_code)
        solver = resolve_code(packed.get(solver, solver), "algorithm", "it")
    run = Run(
        problem=spec,
        solver=solver,
        settings=inputs.settings,
        handling=inputs.handling or "deb",
        evaluations=inputs.evaluations or EVALUATIONS,
        seed=record.seed - record.run,
        number=record.run,
        label=record.solver,
        start=inputs.start,
    )
    if (files := run.read_code()) is not None and files.digest != inputs.code:
        raise InputError(f"{solver!r} is not the code that computed it")
    return run


def _repeat(runs: Sequence[tuple[RunRecord, Run]], progress: Callable[[int, int], None]) -> Iterator[Difference]:
    """Repeat runs, and yield where they differ: the same seed gives the same bits."""
    if not runs:
        return
    done = itertools.count(1)
    study = Study(runs=tuple(run for _, run in runs), jobs=available_cores())
    results = run_study(study, lambda _: progress(next(done), len(runs)))
    for (record, _), again in zip(runs, results, strict=True):
        before, now = record.to_json(), again.to_json()
        for what in (name for name in before if name not in NOT_REPEATED and (record.x or name != "counts")):
            a, b = (json.dumps(plain[what], sort_keys=True) for plain in (before, now))
            if a != b:
                place = next((k for k, pair in enumerate(zip(a, b, strict=False)) if pair[0] != pair[1]), 0)
                a, b = (text[max(0, place - 20) : place + 40] for text in (a, b))
                yield Difference(record.name, "differs", f"{what.replace('_', ' ')}: recorded {a!r}, repeated {b!r}")
                break
