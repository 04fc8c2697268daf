"""Verification of a study: what holds and what does not, in a folder or in an archive."""

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from compare.analysis.comparison import compare_problems
from compare.archive.unpack import unpack_archive
from compare.report.study_report import make_study_document
from compare.report.writing import render_markdown
from compare.study.evidence import name_record, read_evidence
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord, load_problem
from compare.study.record_files import RECORDS
from compare.study.run_task import try_task
from compare.study.settings import FILE, Manifest, read_manifest
from compare.study.task import SOURCE, Handling, Inputs, ProblemSpec, Stop, Task
from nlp_gait.backends.identity import FILES
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import make_temporary_folder, read_text
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.certificate import check_certificate, load_certificates, read_certificate
from nlp_gait.user_code import hash_file, parse_reference, resolve_code

REPORT = "report.md"
# What a repeated run must have in common with its record: everything but the times.
REPEATED = ("status", "x", "evaluations", "history", "failed_evaluations", "iterations", "claimed_objective", "verdict")


class Finding(NamedTuple):
    """One check."""

    what: str  #: that was checked
    holds: bool
    detail: str  #: numbers, or what does not hold

    @property
    def sentence(self) -> str:
        """The finding as one line."""
        return f"{self.what}: {'holds' if self.holds else 'DOES NOT HOLD'}: {self.detail}"


class Verification(NamedTuple):
    """All checks, and the records that passed theirs."""

    findings: list[Finding]
    records: list[RunRecord]


def verify_archive(path: Path, *, share: float = 0.0, progress: Progress = ignore_progress) -> Verification:
    """Check an archive as ``verify_folder``, and its hashes, user code and report; raises InputError if it cannot be unpacked."""
    with make_temporary_folder("nlp-gait-verify-") as folder:
        manifest, differences = unpack_archive(path, folder)
        detail = "; ".join(differences) or f"{len(manifest.files)} files have their SHA-256 of the manifest"
        found = verify_folder(folder, share=share, robots=manifest.robots, progress=progress)
        findings = [Finding("manifest", not differences, detail), *found.findings]
        if found.records:
            findings += _check_code_files(folder, found.records)
            findings.append(_judge(REPORT, lambda: _check_report(folder, found.records)))
        return Verification(findings, found.records)


def verify_folder(
    folder: Path, *, share: float = 0.0, robots: Mapping[str, str] | None = None, progress: Progress = ignore_progress
) -> Verification:
    """Check everything in a study's folder that can be checked.

    Args:
        folder: of the study.
        share: of the runs that are repeated, drawn at random, from 0 to 1; at least one if it is positive.
        robots: files that stand for the options of problems that name files, relative to the folder.
        progress: receives a line for each repeated run.
    """
    places = {option: str(folder / file) for option, file in (robots or {}).items()}

    def find_problem(record: RunRecord) -> GaitProblem:
        return load_problem(_move_files(record, places))

    try:
        records, excluded = read_evidence(folder, "all", find_problem)
    except InputError as error:
        return Verification([Finding("records", False, str(error))], [])
    count, wrong = len(records) + len(excluded), "; ".join(exclusion.sentence for exclusion in excluded)
    detail = (
        f"{len(excluded)} of {count} are no evidence: {wrong}" if excluded else f"all {count} follow from their points"
    )
    findings = [Finding("records", not excluded, detail + ", also between the samples" * (not excluded))]
    findings.append(_judge(FILE, lambda: _check_sessions(records, read_manifest(folder))))
    findings.append(_judge("runs", lambda: _check_runs(folder)))
    for path in sorted((folder / "certificates").glob("*.json")):
        findings.append(_judge(f"certificates/{path.name}", partial(_check_certificate, path)))
    if share > 0.0:
        findings += _repeat_runs(records, share, places, progress)
    return Verification(findings, records)


def _judge(what: str, check: Callable[[], str]) -> Finding:
    """Return the finding of a check, which returns what holds, and raises what does not."""
    try:
        return Finding(what, True, check())
    except GaitError as error:
        return Finding(what, False, str(error))


def _check_sessions(records: Sequence[RunRecord], manifest: Manifest) -> str:
    """Compare the code and machines of records with the sessions of the manifest that computed them."""
    own = [(record, record.origin) for record in records if record.origin is not None]
    if own and not manifest.sessions:
        raise InputError("no session is recorded")
    codes = {session.versions.get("code") for session in manifest.sessions}
    machines = {f"{s.machine.get('processor')}, {s.machine.get('system')}" for s in manifest.sessions}
    started = min((session.started for session in manifest.sessions), default="")
    wrong = [
        f"{name_record(record)} ({why})"
        for record, origin in own
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
    other = any(record.inputs.code != installed for record, _ in own)
    note = f"; other code is installed here ({installed[:8]}), so runs cannot be repeated" if other else ""
    return f"runs computed in a recorded session: {len(own)} of {len(own)}{note}"


def _check_runs(folder: Path) -> str:
    """Require a record of every run of the study."""
    runs = read_manifest(folder).runs
    missing = [name for name in runs if not (folder / RECORDS / f"{name}.json").is_file()]
    if missing:
        raise InputError(f"{len(missing)} of {len(runs)} have no record: {', '.join(missing)}")
    return f"all {len(runs)} that {FILE} lists have a record"


def _check_certificate(path: Path) -> str:
    """Compare an archived certificate with the shipped ones; another one is checked as by ``certainty --check``."""
    file = read_certificate(path)
    shipped = any(file == other for other in load_certificates().values())
    how = "equal to the shipped one" if shipped else f"{check_certificate(file).paths} paths of its proof followed"
    return f"bound {file.certificate.bound:.9g}, {how}"


def _check_code_files(folder: Path, records: Sequence[RunRecord]) -> list[Finding]:
    """Compare the archived code of user-defined solvers, which is not run, with the hashes in the records."""
    parts = [part for r in records if isinstance(part := r.inputs.solver, Mapping) and SOURCE in part]
    known = {(parse_reference(part["name"], "algorithm").short.partition(":")[0], part[SOURCE]) for part in parts}
    findings = []
    for name, digest in sorted(known):
        path = folder / "code" / Path(name).name
        same = path.is_file() and hash_file(path) == digest
        detail = "it is the code of the records" if same else "it is missing, or is not the code of the records"
        findings.append(Finding(f"code/{path.name}", same, detail))
    return findings


def _check_report(folder: Path, records: Sequence[RunRecord]) -> str:
    """Write the report again, and compare its text."""
    comparisons = compare_problems(records)
    document = make_study_document(comparisons, read_manifest(folder))
    again = render_markdown(document).split("\n")
    known = read_text(folder / REPORT, "report").split("\n")
    for number, (a, b) in enumerate(zip_longest(known, again), start=1):
        if a != b:
            raise InputError(f"line {number} is {a!r:.100}, but the records give {b!r:.100}")
    return "it follows from the records"


def _repeat_runs(
    records: Sequence[RunRecord], share: float, places: Mapping[str, str], progress: Progress
) -> list[Finding]:
    known = [record for record in records if not record.inputs.imported and record.x]
    chosen = random.SystemRandom().sample(known, min(len(known), max(1, round(share * len(known)))))
    findings = []
    for record in chosen:
        progress(name_record(record))
        repeat = partial(_repeat_run, record, _move_files(record, places))
        findings.append(_judge(f"repeated: {name_record(record)}", repeat))
    return findings


def _repeat_run(record: RunRecord, moved: RunRecord) -> str:
    """Repeat a run, whose files may have moved: the same seed gives the same bits."""
    try:
        again = try_task(_make_task(record, moved.inputs))
    except (GaitError, ValueError) as error:
        raise InputError(f"it cannot be repeated: {error}") from error
    for what in REPEATED:
        before, now = getattr(record, what), getattr(again, what)
        if before != now and repr(before) != repr(now):  # NaN differs from itself
            raise InputError(f"its {what.replace('_', ' ')} differs: recorded {before!r:.100}, found {now!r:.100}")
    return f"the same {record.evaluations['f']} evaluations, point and history, to the last bit"


def _make_task(record: RunRecord, inputs: Inputs) -> Task:
    """Return the task of a record by its inputs, in which files of the problem may be elsewhere than in the record's.

    Raises:
        InputError: the run ended by the clock, or its solver was an object in Python, or its inputs differ here.
        UserCodeError: it needs user code that the command does not name.
    """
    solver, stored = inputs.solver, decode(StoredProblem, inputs.problem, "problem")
    if not isinstance(solver, str):
        if "name" not in solver:
            raise InputError("its solver was an object of Python, which has no name")
        solver = resolve_code(solver["name"], "algorithm", "the run")
    if inputs.stop.get("time_limit_s") is not None:
        raise InputError("it ended by the clock or could have")
    name, options = resolve_stored(stored.name, stored.options, "the run")
    task = Task(
        problem=ProblemSpec(name=name, options=options, values=stored.parameters, label=record.problem),
        solver=solver,
        settings=inputs.settings,
        handling=inputs.handling or Handling(),
        stop=decode(Stop, inputs.stop),
        seed=record.seed - record.run if record.seed >= record.run else record.seed,
        run=record.run if record.seed >= record.run else 0,
        label=record.solver,
        polish=inputs.polish,
        start=inputs.start,
    )
    if task.inputs().key != record.inputs.key:
        raise InputError("its solver, code or problem is another one here")
    return task


def _move_files(record: RunRecord, places: Mapping[str, str]) -> RunRecord:
    """Return a record whose problem reads its files at other places."""
    problem = record.inputs.problem
    moved = {option: places.get(str(problem["options"][option])) for option in problem.get(FILES, ())}
    options = {**problem["options"], **{option: place for option, place in moved.items() if place}}
    return replace(record, inputs=replace(record.inputs, problem={**problem, "options": options}))
