"""Verification of a study: evaluate all points, repeat the runs, and list what differs, is missing, or was not repeated."""

import json
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from compare.study.pack import find_packed
from compare.study.record import RunRecord, group_by, list_versions
from compare.study.references import SAME_VALUE, find_reference
from compare.study.run import Handling, ProblemSpec, Run, Stop
from compare.study.study import FILE, Study, read_each, read_study_file, run_study
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import describe_difference, hash_json, identify_problem
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.user_code import is_user_code, resolve_code, shorten_reference

# A total violation of up to 1e-6 may improve the objective by up to this much, relatively.
SLACK = 1e-4
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
        """Whether nothing differs and nothing is missing."""
        return all(row.kind == "not repeated" for row in self.rows)

    @property
    def sentence(self) -> str:
        """The result in words, with the chance that altered runs were not among the repeated ones."""
        wrong = sum(row.kind != "not repeated" for row in self.rows)
        total = len(self.records)
        rows = f"{wrong} row{'s' * (wrong > 1)} of the table must not be there"
        result = "nothing differs" if self.holds else rows
        text = f"{self.evaluated} points evaluated and {self.repeated} of {total} runs repeated: {result}"
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
    rows, records = list[Difference](), list[RunRecord]()
    for path, record in read_each(folder):
        if isinstance(record, InputError):
            rows.append(Difference(path.relative_to(folder).as_posix(), "differs", str(record)))
        else:
            records.append(record)
    rows += _list_missing(folder, records)
    runs, evaluated = dict[int, Run](), 0
    for group in group_by(records, lambda record: hash_json(record.inputs.problem)).values():
        try:
            spec = _locate_problem(folder, group[0], run_code)
            found, points = _evaluate_points(spec, group)
        except (GaitError, ValueError) as error:
            rows += [Difference(r.name, "not repeated", f"its problem cannot be made: {error}") for r in group]
            continue
        rows += found
        evaluated += points
        for record in group:
            try:
                runs[id(record)] = _make_run(folder, record, spec, run_code)
            except (GaitError, ValueError) as error:
                rows.append(Difference(record.name, "not repeated", str(error)))
    chosen = [record for record in records if id(record) in runs]
    random.SystemRandom().shuffle(chosen)  # the drawn ones cannot be predicted
    chosen = chosen[: math.ceil(share * len(chosen))]
    rows += _repeat(chosen, runs, progress)
    return Verification(_fold(rows), records, len(chosen), evaluated)


def _fold(rows: Sequence[Difference]) -> list[Difference]:
    """Return one row for all with the same reason."""
    folded = []
    for (kind, why), group in group_by(rows, lambda row: (row.kind, row.why)).items():
        others = f" and {len(group) - 1} more" if len(group) > 1 else ""
        folded.append(Difference(f"{group[0].what}{others}", kind, why))
    return sorted(folded, key=lambda row: row.kind == "not repeated")


def _list_missing(folder: Path, records: Sequence[RunRecord]) -> Iterator[Difference]:
    """Yield planned runs without a record, or with that of another solver or seed, and versions that are not this machine's."""
    there = {(record.problem, record.solver, record.run): record for record in records}
    settings = read_study_file(folder).read_settings(f"study {str(folder / FILE)!r}")
    for run in () if settings is None else settings.make_runs():
        record = there.get((run.problem.title, run.title, run.number))
        if record is None:
            name = f"{run.problem.title}, {run.title}, run {run.number}"
            yield Difference(name, "missing", "it is planned by study.json")
        elif (_shorten(record.inputs.solver), record.seed) != (_shorten(run.solver), run.run_seed):
            planned = f"{run.solver} with seed {run.run_seed}"
            yield Difference(
                record.name, "differs", f"it is of {record.inputs.solver} with seed {record.seed}, planned is {planned}"
            )
    here = list_versions()
    for name in ("nlp-gait", "casadi"):
        others = {
            str(record.versions[name]) for record in records if record.versions.get(name, here[name]) != here[name]
        }
        if others:
            yield Difference(
                name, "not repeated", f"computed by version {', '.join(sorted(others))}; here {here[name]}"
            )


def _shorten(solver: object) -> object:
    return shorten_reference(solver) if isinstance(solver, str) else solver


def _locate_problem(folder: Path, record: RunRecord, run_code: bool) -> ProblemSpec:
    """Return the problem of a record, from files in the folder or from code that the command has named."""
    stored = decode(StoredProblem, record.inputs.problem, "problem")
    packed = find_packed(folder, stored.name, stored.options, stored.files, run_code)
    name, options = packed or resolve_stored(stored.name, stored.options, "the run")
    return ProblemSpec(name=name, options=options, values=stored.parameters, label=record.problem)


def _evaluate_points(spec: ProblemSpec, records: Sequence[RunRecord]) -> tuple[list[Difference], int]:
    """Return what does not follow from the points of records with one problem, and their number."""
    problem, rows, points = spec.load(), list[Difference](), 0
    difference = describe_difference(records[0].inputs.problem, identify_problem(problem))
    reference, model = find_reference(records[0].inputs.problem), build_exact_model(problem)
    for record in records:
        reasons = [f"its problem is another one here: {difference}"] if difference else []
        if record.inputs.objective != problem.objective:
            reasons.append(f"its objective is {record.inputs.objective}, that of the problem {problem.objective}")
        if record.x:
            points += 1
            values = model.at(problem.check_x(record.x), problem.p)
            sign, violation = problem.objective.sign, math.inf if math.isnan(values.violation) else values.violation
            stated = {"objective": record.objective, "violation": record.violation, **record.metrics}
            computed = {"objective": sign * values.cost, "violation": violation, **values.indexes}
            reasons += _compare_numbers(stated, computed)
            if record.feasible != values.feasible:
                word = "feasible" if record.feasible else "infeasible"
                reasons.append(f"it is called {word}, and its violation is {violation:.3g}")
            bound, slack = reference.bound, SAME_VALUE if violation == 0.0 else SLACK
            if bound is not None and record.feasible and sign * (bound - record.objective) > slack * abs(bound):
                reasons.append(f"its objective {record.objective:.9g} is better than the proven bound {bound:.9g}")
        elif record.feasible or record.metrics:
            reasons.append("it has values, but no point")
        rows += [Difference(record.name, "differs", reason) for reason in reasons]
    return rows, points


def _compare_numbers(stated: Mapping[str, float], computed: Mapping[str, float]) -> Iterator[str]:
    if stated.keys() != computed.keys():
        yield "its metrics have other names than those of the problem"
        return
    for name, value in computed.items():
        scale = 0.0 if name == "objective" else 1.0
        if not is_same(stated[name], value, scale):
            yield f"its {name} is {stated[name]:.9g}, but that of its x is {value:.9g}"


def is_same(a: float, b: float, scale: float = 0.0) -> bool:
    """Return whether two numbers agree to nine digits; numbers that are not finite agree with each other."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a == b or not (math.isfinite(a) or math.isfinite(b))
    return abs(a - b) <= SAME_VALUE * max(abs(a), abs(b), scale)


def _make_run(folder: Path, record: RunRecord, spec: ProblemSpec, run_code: bool) -> Run:
    """Return the run of a record; raises InputError that says why it cannot be repeated here."""
    inputs = record.inputs
    if inputs.imported:
        raise InputError("it was imported: its counts, history and seed are as reported")
    if not isinstance(inputs.solver, str):
        raise InputError("its solver was an object of Python, which has no name")
    if inputs.stop.get("time_limit_s") is not None:
        raise InputError("it ended by the clock, or could have")
    solver = inputs.solver
    if inputs.code:
        packed = find_packed(folder, solver, {}, {"code": inputs.code}, run_code)
        solver = packed[0] if packed else resolve_code(solver, "algorithm", "it")
    run = Run(
        problem=spec,
        solver=solver,
        settings=inputs.settings,
        handling=inputs.handling or Handling(),
        stop=decode(Stop, inputs.stop),
        seed=record.seed - record.run,
        number=record.run,
        label=record.solver,
        polish=inputs.polish,
        start=inputs.start,
    )
    if is_user_code(solver, "algorithm") and (files := run.read_code()) is not None and files.digest != inputs.code:
        raise InputError(f"{solver!r} is not the code that computed it")
    return run


def _repeat(
    records: Sequence[RunRecord], runs: Mapping[int, Run], progress: Callable[[int, int], None]
) -> Iterator[Difference]:
    """Repeat runs, and yield where they differ: the same seed gives the same bits."""
    if not records:
        return
    done = 0

    def count(_: RunRecord) -> None:
        nonlocal done
        done += 1
        progress(done, len(records))

    study = Study(runs=tuple(runs[id(record)] for record in records), jobs=available_cores())
    for record, again in zip(records, run_study(study, count), strict=True):
        before, now = record.to_json(), again.to_json()
        for what in (name for name in before if name not in NOT_REPEATED):
            a, b = (json.dumps(plain[what], sort_keys=True) for plain in (before, now))
            if a != b:
                place = next((k for k, pair in enumerate(zip(a, b, strict=False)) if pair[0] != pair[1]), 0)
                a, b = (text[max(0, place - 20) : place + 40] for text in (a, b))
                yield Difference(record.name, "differs", f"{what.replace('_', ' ')}: recorded {a!r}, repeated {b!r}")
                break
