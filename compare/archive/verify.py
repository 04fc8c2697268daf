"""Verification of a study: what holds, what does not and what was not checked, in a folder or in an archive.

What can be computed is computed again and compared: every point, random runs, report and tables. Times stay as recorded.
"""

import json
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import zip_longest
from operator import call
from pathlib import Path
from typing import NamedTuple

from compare.archive.unpack import unpack_archive
from compare.report import FurtherFiles, write_report
from compare.study.evidence import CheckedRecords, compute_in_forks, name_record, read_evidence
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord, find_best, group_by, load_problem
from compare.study.record_files import RECORDS, name_run
from compare.study.run_task import try_task
from compare.study.settings import FILE, Manifest, read_manifest
from compare.study.task import SOURCE, Handling, Inputs, ProblemSpec, Stop, Task
from nlp_gait.backends.identity import FILES
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError, UserCodeError
from nlp_gait.files import make_temporary_folder, read_bytes
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.certificate import check_certificate, load_certificates, read_certificate
from nlp_gait.user_code import hash_file, is_user_code, parse_reference, resolve_code

# Fields in which a repeated run may differ from its record.
NOT_REPEATED = ("problem", "solver", "run", "inputs", "time_s", "origin")
MOST_CERTIFICATES = 20  # whose proofs are followed in one call
PAGES = ("report.html", "report.md")
MOST_NAMED = 5  # runs or files in a sentence


class NotCheckedError(GaitError):
    """Something cannot be checked here."""


class Finding(NamedTuple):
    """One check."""

    what: str  #: that was checked
    holds: bool | None  #: None: not checked
    detail: str  #: numbers, what does not hold, or why it was not checked

    @property
    def sentence(self) -> str:
        """The finding as one line."""
        word = "not checked" if self.holds is None else "holds" if self.holds else "DOES NOT HOLD"
        return f"{self.what}: {word}: {self.detail}"


class Verification(NamedTuple):
    """All checks, and two lines: what was evaluated and repeated, and what was not."""

    findings: list[Finding]
    scope: tuple[str, ...] = ()


def verify_archive(path: Path, *, share: float | None = None, progress: Progress = ignore_progress) -> Verification:
    """Check an archive as ``verify_folder``, and its hashes and user code; raises InputError if it cannot be unpacked."""
    with make_temporary_folder("nlp-gait-verify-") as folder:
        manifest, differences = unpack_archive(path, folder)
        detail = "; ".join(differences) or f"{len(manifest.files)} files have their SHA-256 of the manifest"
        findings, scope = verify_folder(folder, share=share, robots=manifest.robots, progress=progress)
        return Verification([Finding("manifest", not differences, detail), *findings], scope)


def verify_folder(
    folder: Path,
    *,
    share: float | None = None,
    robots: Mapping[str, str] | None = None,
    progress: Progress = ignore_progress,
) -> Verification:
    """Check everything in a study's folder that can be checked.

    Args:
        folder: of the study.
        share: of the runs that are repeated, drawn at random, from 0 to 1; None for one run of each solver and problem, and the
            run whose prices are shown.
        robots: files of an archive that stand for the options of problems that name files, relative to the folder.
        progress: receives a line when the texts are compared, and when a run is repeated.
    """
    places = {option: str(folder / file) for option, file in (robots or {}).items()}

    def find_problem(record: RunRecord) -> GaitProblem:
        return load_problem(_move_files(record, places))

    try:
        evidence, manifest = read_evidence(folder, "all", find_problem), read_manifest(folder)
    except InputError as error:
        return Verification([Finding("records", False, str(error))])
    records = evidence.records
    findings = list(_report_evidence(evidence))
    findings.append(_judge(FILE, lambda: _check_sessions(records, manifest)))
    everyone = [*records, *(e.record for e in evidence.excluded if e.record is not None)]
    findings.append(_judge("runs", lambda: _check_plan(folder, manifest, everyone)))
    for number, path in enumerate(sorted((folder / "certificates").glob("*.json"))):
        findings.append(_judge(f"certificates/{path.name}", partial(_check_certificate, path, number)))
    check_texts = partial(_judge, "texts", lambda: _check_texts(folder, manifest, evidence))
    rewritten, *repeated = _repeat_runs(records, share, places, progress, check_texts)
    scope = _describe_scope(folder, records, sum(f.holds is not None for f in repeated))
    wrong = [finding for finding in repeated if not finding.holds]
    same = [Finding("repeated runs", True, f"{len(repeated) - len(wrong)} have the same results, to the last bit")]
    codes = [] if robots is None else _check_code_files(folder, records)
    return Verification([*findings, rewritten, *codes, *wrong, *(same if len(wrong) < len(repeated) else [])], scope)


def _judge(what: str, check: Callable[[], str]) -> Finding:
    """Return the finding of a check, which returns what holds, and raises what does not."""
    try:
        return Finding(what, True, check())
    except (NotCheckedError, UserCodeError) as error:
        return Finding(what, None, str(error))
    except GaitError as error:
        return Finding(what, False, str(error))


def _report_evidence(evidence: CheckedRecords) -> Iterator[Finding]:
    wrong = [exclusion for exclusion in evidence.excluded if not exclusion.needs_code]
    unread = [exclusion for exclusion in evidence.excluded if exclusion.needs_code]
    count = len(evidence.records) + len(wrong)
    no_evidence = f"{len(wrong)} of {count} are no evidence: {'; '.join(e.sentence for e in wrong)}"
    follow = f"all {count} follow from their points, also between the samples"
    yield Finding("records", not wrong, no_evidence if wrong else follow)
    if unread:
        yield Finding("records of user code", None, f"{len(unread)}: {unread[0].sentence}")
    imported = [name_record(record) for record in evidence.records if record.inputs.imported]
    if imported:
        yield Finding("imported runs", None, f"counts, histories and seeds are claims: {_list_some(imported)}")


def _list_some(names: Sequence[str]) -> str:
    unnamed = len(names) - MOST_NAMED
    return f"{', '.join(names[:MOST_NAMED])}{f' and {unnamed} more' if unnamed > 0 else ''}"


def _check_sessions(records: Sequence[RunRecord], manifest: Manifest) -> str:
    """Compare the code and machines of records with the sessions of the manifest that computed them."""
    computed = [(record, record.origin) for record in records if record.origin is not None]
    if computed and not manifest.sessions:
        raise InputError("no session is recorded")
    codes = {session.versions.get("code") for session in manifest.sessions}
    machines = {f"{s.machine.get('processor')}, {s.machine.get('system')}" for s in manifest.sessions}
    started = min((session.started for session in manifest.sessions), default="")
    wrong = [
        f"{name_record(record)} ({why})"
        for record, origin in computed
        for holds, why in (
            (record.inputs.code[:8] in codes, "no session ran its code"),
            (origin.machine in machines, "no session ran on its machine"),
            (record.time_s.finished >= started, "it ended before the first session"),
        )
        if not holds
    ]
    if wrong:
        raise InputError("; ".join(wrong))
    installed = hash_installed_code()
    differs = any(record.inputs.code != installed for record, _ in computed)
    note = f"; other code is installed here ({installed[:8]})" if differs else ""
    return f"runs computed in a recorded session: {len(computed)} of {len(computed)}{note}"


def _check_plan(folder: Path, manifest: Manifest, records: Sequence[RunRecord]) -> str:
    """Compare the runs with those that ``study.json`` lists and plans; numbers and seeds of a solver's runs have no gaps."""
    there = {(r.problem, r.solver, r.run): r for r in records if not r.inputs.imported}
    settings = manifest.settings
    planned = {(t.problem.title, t.title, t.run): t for t in (() if settings is None else settings.tasks())}
    wrong = [f"{name} has no record" for name in manifest.runs if not (folder / RECORDS / f"{name}.json").is_file()]
    for key in planned.keys() - there.keys():
        wrong.append(f"{key[0]}, {key[1]}, run {key[2]} is planned, but missing")
    for key, record in there.items():
        if task := planned.get(key):
            wrong += [f"{name_record(record)} has other {what} than planned" for what in _find_deviations(record, task)]
    commanded = {key[:2] for key in planned}
    for group, runs in group_by(there.values(), lambda r: (r.problem, r.solver)).items():
        if group in commanded:
            wrong += [f"{name_record(r)} is not planned" for r in runs if (r.problem, r.solver, r.run) not in planned]
        elif {r.run for r in runs} != set(range(len(runs))) or len({r.seed - r.run for r in runs}) > 1:
            wrong.append(f"the runs or seeds of {group[1]} on {group[0]} have gaps")
    if wrong:
        raise InputError(f"{len(wrong)} differ: {_list_some(sorted(wrong))}")
    return f"all {len(manifest.runs)} that {FILE} lists have a record; {len(planned)} are planned by its settings"


def _find_deviations(record: RunRecord, task: Task) -> Iterator[str]:
    """Yield what of a record's inputs is not as its task plans it."""
    inputs, problem = record.inputs, record.inputs.problem
    solver = inputs.solver["name"] if isinstance(inputs.solver, Mapping) else inputs.solver
    same_solver = solver == task.solver or task.is_user_code
    limits, spec = task.stop.limits, task.problem
    for what, is_same in (
        ("seed", inputs.seed == task.run_seed),
        ("solver", same_solver and inputs.polish == task.polish),
        ("settings", dict(inputs.settings) == dict(task.settings)),
        ("constraint handling", inputs.handling in (None, task.handling)),
        ("limits", inputs.stop.items() <= limits.items() and (not inputs.is_search or inputs.stop == limits)),
        ("problem", problem["name"] == spec.address or is_user_code(spec.address, "problem")),
        ("options", spec.options.items() <= {**problem["options"]}.items()),
        ("parameters", dict(problem["parameters"]) == dict(spec.values)),
    ):
        if not is_same:
            yield what


def _check_certificate(path: Path, number: int) -> str:
    """Compare an archived certificate with the shipped ones; another one is checked as by ``certainty --check``."""
    file = read_certificate(path)
    if any(file == shipped for shipped in load_certificates().values()):
        how = "equal to the shipped one"
    elif number >= MOST_CERTIFICATES:
        raise NotCheckedError(f"{MOST_CERTIFICATES} are checked in one call; check it by certainty --check")
    else:
        how = f"{check_certificate(file).paths} paths of its proof followed"
    return f"bound {file.certificate.bound:.9g}, {how}"


def _check_code_files(folder: Path, records: Sequence[RunRecord]) -> list[Finding]:
    """Compare the archived code of user-defined solvers, which is not run, with the hashes in the records."""
    solvers = [solver for r in records if isinstance(solver := r.inputs.solver, Mapping) and SOURCE in solver]
    sources = {
        (parse_reference(solver["name"], "algorithm").short.partition(":")[0], solver[SOURCE]) for solver in solvers
    }
    findings = []
    for name, digest in sorted(sources):
        path = folder / "code" / Path(name).name
        same = path.is_file() and hash_file(path) == digest
        detail = "it is the code of the records" if same else "it is missing, or is not the code of the records"
        findings.append(Finding(f"code/{path.name}", same, detail))
    return findings


def _check_texts(folder: Path, manifest: Manifest, evidence: CheckedRecords) -> str:
    """Write the report, its figures and tables again, and compare all that are there."""
    if not any((folder / name).exists() for name in PAGES):
        raise NotCheckedError("there is no report")
    if any(exclusion.needs_code for exclusion in evidence.excluded):
        raise NotCheckedError("the report needs the records of user code")
    with make_temporary_folder("nlp-gait-report-") as fresh:
        further = FurtherFiles(csv=(folder / "runs.csv").exists())
        written = write_report(fresh, evidence.records, manifest, excluded=evidence.excluded, further=further)
        missing = [path.name for path in written if not (folder / path.name).exists()]
        if missing:
            raise InputError(f"{_list_some(missing)} should be there")
        for path in written:
            archived, again = read_bytes(folder / path.name, "text"), path.read_bytes()
            if archived != again:
                pairs = zip_longest(archived.decode(errors="replace").split("\n"), again.decode().split("\n"))
                number, a, b = next((n, a, b) for n, (a, b) in enumerate(pairs, start=1) if a != b)
                raise InputError(
                    f"line {number} of {path.name} is {a!r:.100}, but the records give {b!r:.100}; if another "
                    "version wrote it, write it again with `report`"
                )
    return f"{_list_some([path.name for path in written])} follow from the records"


def _describe_scope(folder: Path, records: Sequence[RunRecord], repeated: int) -> tuple[str, str]:
    """Return a line about what was evaluated and repeated, and one about what was not checked."""
    listed = {name_run(record) for record in records}
    unlisted = sum(path.relative_to(folder / RECORDS).with_suffix("").as_posix() not in listed
                 for path in (folder / RECORDS).glob("*/*.json"))  # fmt: skip
    unrepeated = len(records) - repeated
    parts = [f"the course of {unrepeated} runs that were not repeated"] if unrepeated else []
    parts += ["times and machines: as recorded", "runs that were made, but never listed"]
    if any(isinstance(record.inputs.solver, Mapping) for record in records):
        parts += ["evaluations that user code makes by loading the problem itself"]
    parts += [f"{unlisted} other records in the folder"] if unlisted else []
    foreign = [p.name for p in sorted(folder.iterdir()) if p.is_file() and p.suffix in (".tex", ".pdf", ".png")]
    parts += [f"{_list_some(foreign)}"] if foreign else []
    points = sum(bool(record.x) for record in records)
    done = f"evaluated: {points} points; repeated: {repeated} of {len(records)} runs, drawn at random"
    return done, f"not checked: {'; '.join(parts)}"


def _choose_runs(records: Sequence[RunRecord], share: float | None) -> list[RunRecord]:
    """Return the runs to repeat; a forger cannot predict which."""
    computed = [record for record in records if not record.inputs.imported]
    random.SystemRandom().shuffle(computed)
    if share is not None:
        return computed[: math.ceil(share * len(computed))]
    first: dict[object, RunRecord] = {}
    for problem, runs in group_by(computed, lambda record: record.problem).items():
        if best := find_best(run for run in runs if run.active_constraints):  # whose prices the report shows
            first[problem] = best
    for record in computed:
        first.setdefault((record.problem, record.solver), record)
    return list({id(record): record for record in first.values()}.values())


def _repeat_runs(
    records: Sequence[RunRecord],
    share: float | None,
    places: Mapping[str, str],
    progress: Progress,
    check_texts: Callable[[], Finding],
) -> list[Finding]:
    """Return the finding about the texts, which are written next to the runs, and one for each repeated run."""
    chosen = _choose_runs(records, share)
    repeats = (partial(_judge, f"repeated: {name_record(r)}", partial(_repeat_run, r, places)) for r in chosen)
    checks: list[Callable[[], Finding]] = [check_texts, *repeats]
    findings = []
    for finding in compute_in_forks(call, checks):
        progress(finding.what)
        findings.append(finding)
    return findings


def _repeat_run(record: RunRecord, places: Mapping[str, str]) -> str:
    """Repeat a run, whose files may have moved: the same seed gives the same bits."""
    again = try_task(_make_task(record, _move_files(record, places).inputs))
    recorded, repeated = record.to_json(), again.to_json()
    for what in (name for name in recorded if name not in NOT_REPEATED):
        before, now = (json.dumps(plain[what], sort_keys=True) for plain in (recorded, repeated))
        if before != now:
            text = f"its {what.replace('_', ' ')} differs: recorded {before:.100}, found {now:.100}"
            if record.inputs.code != again.inputs.code:
                raise NotCheckedError(f"{text}; other code is installed here")
            raise InputError(text)
    return f"the same {record.evaluations['f']} evaluations, point and history, to the last bit"


def _make_task(record: RunRecord, inputs: Inputs) -> Task:
    """Return the task of a record by its inputs, in which files of the problem may be elsewhere than in the record's.

    Raises UserCodeError for code that the command does not name, and NotCheckedError for other runs that cannot be repeated here.
    """
    solver, stored = inputs.solver, decode(StoredProblem, inputs.problem, "problem")
    if not isinstance(solver, str):
        if "name" not in solver:
            raise NotCheckedError("its solver was an object of Python, which has no name")
        solver = resolve_code(solver["name"], "algorithm", "the run")
    if inputs.stop.get("time_limit_s") is not None:
        raise NotCheckedError("it ended by the clock or could have")
    name, options = resolve_stored(stored.name, stored.options, "the run")
    task = Task(
        problem=ProblemSpec(name=name, options=options, values=stored.parameters, label=record.problem),
        solver=solver,
        settings=inputs.settings,
        handling=inputs.handling or Handling(),
        stop=decode(Stop, inputs.stop),
        seed=record.seed,
        label=record.solver,
        polish=inputs.polish,
        start=inputs.start,
    )
    if replace(task.inputs(), code=record.inputs.code).key != record.inputs.key:
        raise NotCheckedError("its solver or problem is another one here")
    return task


def _move_files(record: RunRecord, places: Mapping[str, str]) -> RunRecord:
    """Return a record whose problem reads its files at other places."""
    problem = record.inputs.problem
    moved = {option: places.get(str(problem["options"][option])) for option in problem.get(FILES, ())}
    options = {**problem["options"], **{option: place for option, place in moved.items() if place}}
    return replace(record, inputs=replace(record.inputs, problem={**problem, "options": options}))
