"""Verification of a study: what holds and what does not, in a folder or in an unpacked archive."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from compare.analysis.comparison import label_editions
from compare.analysis.simulated_gaits import select_best_gaits
from compare.archive.rerun import compare_runs, make_task
from compare.report.study_report import make_study_document
from compare.report.writing import markdown_page
from compare.study.evidence import Evidence, name_record, read_evidence
from compare.study.manifest import FILE, Manifest, read_manifest
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord, load_problem
from compare.study.simulations import load_simulations
from nlp_gait.backends.identity import FILES, SOURCE
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.certificate import load_certificates, read_certificate
from nlp_gait.proofs.check import check_certificate
from nlp_gait.user_code import hash_file, parse_reference

REPORT = "report.md"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One check."""

    what: str  #: that was checked
    holds: bool
    detail: str  #: numbers, or what does not hold

    @property
    def sentence(self) -> str:
        """The finding as one line."""
        return f"{self.what}: {'holds' if self.holds else 'DOES NOT HOLD'}: {self.detail}"


def verify_folder(
    folder: Path,
    *,
    share: float = 0.0,
    robots: Mapping[str, str] | None = None,
    is_archive: bool = False,
    progress: Progress = ignore_progress,
) -> list[Finding]:
    """Check everything in a study's folder that can be checked.

    Args:
        folder: of the study.
        share: of the runs that are repeated, drawn at random, from 0 to 1; at least one if it is positive.
        robots: files that stand for the options of problems that name files, relative to the folder.
        is_archive: whether the report must follow from the records, and user code be included.
        progress: receives a line for each repeated run.
    """
    places = {option: str(folder / file) for option, file in (robots or {}).items()}

    def find_problem(record: RunRecord) -> GaitProblem:
        return load_problem(_move_files(record, places))

    try:
        evidence = read_evidence(folder, "all", find_problem)
    except InputError as error:
        return [Finding(what="records", holds=False, detail=str(error))]
    findings = [_describe_records(evidence)]
    manifest = Manifest(settings=None, sessions=())
    try:
        manifest = read_manifest(folder)
        findings += check_sessions(evidence.records, manifest)
    except InputError as error:
        findings.append(Finding(what=FILE, holds=False, detail=str(error)))
    findings += _check_certificates(folder)
    if is_archive:
        findings += _check_code_files(folder, evidence.records)
        findings.append(_check_report(folder, evidence.records, manifest))
    if share > 0.0:
        findings += _repeat_runs(evidence.records, share, places, progress)
    return findings


def _describe_records(evidence: Evidence) -> Finding:
    count = len(evidence.records) + len(evidence.excluded)
    if not evidence.excluded:
        return Finding(
            what="records", holds=True, detail=f"all {count} follow from their points, also between the samples"
        )
    listed = "; ".join(exclusion.sentence for exclusion in evidence.excluded)
    return Finding(what="records", holds=False, detail=f"{len(evidence.excluded)} of {count} are no evidence: {listed}")


def check_sessions(records: Sequence[RunRecord], manifest: Manifest) -> list[Finding]:
    """Compare the code and machines of records with the sessions of the manifest that computed them."""
    own = [record for record in records if record.origin is not None]
    codes = {session.versions.get("code") for session in manifest.sessions}
    machines = {f"{s.machine.get('processor')}, {s.machine.get('system')}" for s in manifest.sessions}
    started = min((session.started for session in manifest.sessions), default="")
    wrong = [
        f"{name_record(r)} ({why})"
        for r in own
        for why in (
            "" if r.origin is None or r.origin.code_sha256[:8] in codes else "no session ran its code",
            "" if r.origin is None or r.origin.machine in machines else "no session ran on its machine",
            "" if r.time_s.finished >= started else "it ended before the first session",
        )
        if why
    ]
    if own and not manifest.sessions:
        wrong = ["no session is recorded"]
    if wrong:
        return [Finding(what=FILE, holds=False, detail="; ".join(wrong))]
    installed = hash_installed_code()
    used = {r.origin.code_sha256 for r in own if r.origin is not None}
    note = (
        "" if used <= {installed} else f"; other code is installed here ({installed[:8]}), so runs cannot be repeated"
    )
    return [Finding(what=FILE, holds=True, detail=f"{len(manifest.sessions)} sessions explain {len(own)} runs{note}")]


def _check_certificates(folder: Path) -> list[Finding]:
    """Compare archived certificates with the shipped ones; others are checked as by ``certainty --check``."""
    findings = []
    for path in sorted((folder / "certificates").glob("*.json")):
        try:
            file = read_certificate(path)
            if any(file == shipped for shipped in load_certificates().values()):
                detail = f"bound {file.certificate.bound:.9g}, equal to the shipped one"
            else:
                check = check_certificate(file)
                detail = f"bound {file.certificate.bound:.9g}, {check.paths} paths of its proof followed"
            findings.append(Finding(what=f"certificates/{path.name}", holds=True, detail=detail))
        except GaitError as error:
            findings.append(Finding(what=f"certificates/{path.name}", holds=False, detail=str(error)))
    return findings


def _check_code_files(folder: Path, records: Sequence[RunRecord]) -> list[Finding]:
    """Compare archived user code, which is not run, with the hashes in the records."""
    parts = [part for r in records for part in (r.definition["problem"], r.definition["solver"]) if SOURCE in part]
    known = {(parse_reference(part["name"], "algorithm").short.partition(":")[0], part[SOURCE]) for part in parts}
    findings = []
    for name, digest in sorted(known):
        path = folder / "code" / Path(name).name
        same = path.is_file() and hash_file(path) == digest
        detail = "it is the code of the records" if same else "it is missing, or is not the code of the records"
        findings.append(Finding(what=f"code/{path.name}", holds=same, detail=detail))
    return findings


def _check_report(folder: Path, records: Sequence[RunRecord], manifest: Manifest) -> Finding:
    """Write the report again, and compare its text."""
    labelled = label_editions(records)
    try:
        simulated = load_simulations(folder, select_best_gaits(labelled))
        again = markdown_page(make_study_document(labelled, manifest, simulated=simulated))
        known = (folder / REPORT).read_text(encoding="utf-8")
    except (GaitError, OSError, UnicodeError) as error:
        return Finding(what=REPORT, holds=False, detail=str(error))
    for number, (a, b) in enumerate(zip(known.splitlines(), again.splitlines(), strict=False), start=1):
        if a != b:
            return Finding(
                what=REPORT, holds=False, detail=f"line {number} is {a[:100]!r}, but the records give {b[:100]!r}"
            )
    if known != again:
        return Finding(what=REPORT, holds=False, detail="it is shorter or longer than what the records give")
    return Finding(what=REPORT, holds=True, detail="it follows from the records")


def _repeat_runs(
    records: Sequence[RunRecord], share: float, places: Mapping[str, str], progress: Progress
) -> list[Finding]:
    known = [record for record in records if "imported" not in record.definition and record.x]
    chosen = random.SystemRandom().sample(known, min(len(known), max(1, round(share * len(known)))))
    findings = []
    for record in chosen:
        progress(name_record(record))
        try:
            moved = _move_files(record, places)
            difference = compare_runs(record, make_task(moved, record), records)
        except (GaitError, ValueError) as error:
            difference = f"it cannot be repeated: {error}"
        detail = difference or f"the same {record.evaluations['f']} evaluations, point and history, to the last bit"
        findings.append(Finding(what=f"repeated: {name_record(record)}", holds=not difference, detail=detail))
    return findings


def _move_files(record: RunRecord, places: Mapping[str, str]) -> RunRecord:
    """Return a record whose problem reads its files at other places."""
    problem = record.definition["problem"]
    moved = {option: places.get(str(problem["options"][option])) for option in problem.get(FILES, ())}
    options = {**problem["options"], **{option: place for option, place in moved.items() if place}}
    return replace(record, definition={**record.definition, "problem": {**problem, "options": options}})
