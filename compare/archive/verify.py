"""Verification of a study: what holds and what does not, in a folder or in an archive."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from compare.analysis.comparison import compare_problems, label_editions
from compare.analysis.simulated_gaits import select_best_gaits
from compare.analysis.tuning import read_tunings
from compare.archive.rerun import compare_runs, make_task
from compare.archive.unpack import unpack_archive
from compare.report.study_report import make_study_document
from compare.report.writing import markdown_page
from compare.study.evidence import name_record, read_evidence
from compare.study.record import RunRecord, hash_installed_code, load_problem
from compare.study.settings import FILE, Manifest, read_manifest
from compare.study.simulations import load_simulations
from nlp_gait.backends.identity import FILES, SOURCE
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import make_temporary_folder
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.certificate import check_certificate, load_certificates, read_certificate
from nlp_gait.user_code import hash_file, parse_reference

REPORT = "report.md"


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


def verify_archive(
    path: Path, *, share: float = 0.0, has_report: bool = True, progress: Progress = ignore_progress
) -> Verification:
    """Check an archive as ``verify_folder``, its hashes and its user code; raises InputError if it cannot be unpacked.

    ``has_report`` says whether its report must follow from the records.
    """
    with make_temporary_folder("nlp-gait-verify-") as folder:
        manifest, differences = unpack_archive(path, folder)
        detail = "; ".join(differences) or f"{len(manifest.files)} files have their SHA-256 of the manifest"
        found = verify_folder(folder, share=share, robots=manifest.robots, progress=progress)
        findings = [Finding("manifest", not differences, detail), *found.findings]
        if found.records:
            findings += _check_code_files(folder, found.records)
        if found.records and has_report:
            findings.append(_check_report(folder, found.records))
        return Verification(findings, found.records)


def verify_folder(
    folder: Path,
    *,
    share: float = 0.0,
    robots: Mapping[str, str] | None = None,
    progress: Progress = ignore_progress,
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
    try:
        findings.append(_check_sessions(records, read_manifest(folder)))
    except InputError as error:
        findings.append(Finding(FILE, False, str(error)))
    findings += [_check_certificate(path) for path in sorted((folder / "certificates").glob("*.json"))]
    if share > 0.0:
        findings += _repeat_runs(records, share, places, progress)
    return Verification(findings, records)


def _check_sessions(records: Sequence[RunRecord], manifest: Manifest) -> Finding:
    """Compare the code and machines of records with the sessions of the manifest that computed them."""
    own = [(record, record.origin) for record in records if record.origin is not None]
    if own and not manifest.sessions:
        return Finding(FILE, False, "no session is recorded")
    codes = {session.versions.get("code") for session in manifest.sessions}
    machines = {f"{s.machine.get('processor')}, {s.machine.get('system')}" for s in manifest.sessions}
    started = min((session.started for session in manifest.sessions), default="")
    wrong = [
        f"{name_record(record)} ({why})"
        for record, origin in own
        for holds, why in (
            (origin.code_sha256[:8] in codes, "no session ran its code"),
            (origin.machine in machines, "no session ran on its machine"),
            (record.time_s.finished >= started, "it ended before the first session"),
        )
        if not holds
    ]
    installed = hash_installed_code()
    other = any(origin.code_sha256 != installed for _, origin in own)
    note = f"; other code is installed here ({installed[:8]}), so runs cannot be repeated" if other else ""
    detail = "; ".join(wrong) or f"runs computed in a recorded session: {len(own)} of {len(own)}{note}"
    return Finding(FILE, not wrong, detail)


def _check_certificate(path: Path) -> Finding:
    """Compare an archived certificate with the shipped ones; another one is checked as by ``certainty --check``."""
    what = f"certificates/{path.name}"
    try:
        file = read_certificate(path)
        shipped = any(file == other for other in load_certificates().values())
        how = "equal to the shipped one" if shipped else f"{check_certificate(file).paths} paths of its proof followed"
        return Finding(what, True, f"bound {file.certificate.bound:.9g}, {how}")
    except GaitError as error:
        return Finding(what, False, str(error))


def _check_code_files(folder: Path, records: Sequence[RunRecord]) -> list[Finding]:
    """Compare archived user code, which is not run, with the hashes in the records."""
    parts = [part for r in records for part in (r.definition["problem"], r.definition["solver"]) if SOURCE in part]
    known = {(parse_reference(part["name"], "algorithm").short.partition(":")[0], part[SOURCE]) for part in parts}
    findings = []
    for name, digest in sorted(known):
        path = folder / "code" / Path(name).name
        same = path.is_file() and hash_file(path) == digest
        detail = "it is the code of the records" if same else "it is missing, or is not the code of the records"
        findings.append(Finding(f"code/{path.name}", same, detail))
    return findings


def _check_report(folder: Path, records: Sequence[RunRecord]) -> Finding:
    """Write the report again, and compare its text."""
    try:
        comparisons = compare_problems(label_editions(records))
        simulated = load_simulations(folder, select_best_gaits(comparisons))
        document = make_study_document(comparisons, read_manifest(folder), simulated, tunings=read_tunings(folder))
        again = markdown_page(document).split("\n")
        known = (folder / REPORT).read_text(encoding="utf-8").split("\n")
    except (GaitError, OSError, UnicodeError) as error:
        return Finding(REPORT, False, str(error))
    for number, (a, b) in enumerate(zip_longest(known, again), start=1):
        if a != b:
            return Finding(REPORT, False, f"line {number} is {a!r:.100}, but the records give {b!r:.100}")
    return Finding(REPORT, True, "it follows from the records")


def _repeat_runs(
    records: Sequence[RunRecord], share: float, places: Mapping[str, str], progress: Progress
) -> list[Finding]:
    known = [record for record in records if "imported" not in record.definition and record.x]
    chosen = random.SystemRandom().sample(known, min(len(known), max(1, round(share * len(known)))))
    findings = []
    for record in chosen:
        progress(name_record(record))
        try:
            task = make_task(_move_files(record, places), record)
            difference = compare_runs(record, task, records)
        except (GaitError, ValueError) as error:
            difference = f"it cannot be repeated: {error}"
        detail = difference or f"the same {record.evaluations['f']} evaluations, point and history, to the last bit"
        findings.append(Finding(f"repeated: {name_record(record)}", not difference, detail))
    return findings


def _move_files(record: RunRecord, places: Mapping[str, str]) -> RunRecord:
    """Return a record whose problem reads its files at other places."""
    problem = record.definition["problem"]
    moved = {option: places.get(str(problem["options"][option])) for option in problem.get(FILES, ())}
    options = {**problem["options"], **{option: place for option, place in moved.items() if place}}
    return replace(record, definition={**record.definition, "problem": {**problem, "options": options}})
