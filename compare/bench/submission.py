"""Submissions to GaitBench: the archive of a bench folder, and its verification by the rules of the suite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.archive.pack import pack_study
from compare.archive.verify import Finding, Verification, verify_archive
from compare.study.evidence import read_evidence
from compare.study.record import RunRecord
from nlp_gait.errors import InputError
from nlp_gait.gaitbench.generated import find_test_day, is_generated, parse_id
from nlp_gait.progress import Progress, ignore_progress

SUFFIX = ".zip"
LEAST_RUNS = 2


def pack_submission(folder: Path, out: Path) -> Path:
    """Write the submission of a folder of ``nlp-gait bench``, and return it.

    It contains records, user code, settings, budget and versions, with their hashes.

    Raises:
        InputError: a record is no evidence, or a rule of ``check_rules`` is broken.
        UserCodeError: user code took part that the command does not name.
        OutputError: the file cannot be written.
    """
    records, excluded = read_evidence(folder, "all")
    wrong = [exclusion.sentence for exclusion in excluded] + [f.sentence for f in check_rules(records) if not f.holds]
    if wrong:
        raise InputError(f"{str(folder)!r} cannot be submitted: {'; '.join(wrong)}")
    return pack_study(folder, records, out)


def verify_submission(path: Path, *, share: float, progress: Progress = ignore_progress) -> Verification:
    """Judge every final point of a submission again, repeat a share of its runs, and check the rules.

    Args:
        path: the file; its user code runs only if the caller has allowed it.
        share: of the runs that are repeated bit by bit, drawn at random; only a repeated run proves its history.
        progress: receives a line for each repeated run.

    Raises:
        InputError: the file cannot be unpacked.
    """
    findings, records = verify_archive(path, share=share, has_report=False, progress=progress)
    return Verification([*findings, *check_rules(records)], records)


def check_rules(records: Sequence[RunRecord]) -> list[Finding]:
    """Check the rules: the same seeds and budget on all instances, of GaitBench 1 or by the test seeds of one day."""
    if not records:
        return [Finding("rules", False, "there are no runs")]
    seeds: dict[tuple[str, str], list[int]] = {}
    budgets = set()
    for record in records:
        seeds.setdefault((record.solver, record.problem), []).append(record.seed)
        budgets.add((record.definition.get("stop") or {}).get("evaluations"))
    equal = (
        all(sorted(own) == list(range(len(own))) for own in seeds.values())
        and len({len(s) for s in seeds.values()}) == 1
    )
    enough = min(len(own) for own in seeds.values()) >= LEAST_RUNS
    drawn = {parse_id(r.problem)[1].seed for r in records if is_generated(r.problem)}
    days = set(map(find_test_day, drawn))
    return [
        Finding("seeds of runs", equal and enough, f"at least {LEAST_RUNS} runs, 0, 1, ..., as many on each instance"),
        Finding("budget", len(budgets) == 1, f"evaluations of a run: {', '.join(map(str, budgets))}"),
        Finding(
            "instances",
            None not in days and len(days) <= 1,
            "of GaitBench 1 or by test seeds of one day (--seeds test:5); training seeds are for tuning",
        ),
    ]
