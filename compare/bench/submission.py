"""Submissions to GaitBench: the archive of a bench folder, its verification by the rules of the suite, and pages of all."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from compare.archive.pack import pack_study
from compare.archive.verify import Finding, Verification, verify_archive
from compare.bench.leaderboard import filter_instances, make_leaderboard_page, rank_solvers
from compare.report.document import Document, Prose, Section
from compare.report.writing import write_document
from compare.study.evidence import read_evidence
from compare.study.record import RunRecord
from nlp_gait.backends.identity import hash_json
from nlp_gait.errors import InputError
from nlp_gait.files import make_folder
from nlp_gait.gaitbench.generated import find_test_day, is_generated, parse_id
from nlp_gait.progress import Progress, ignore_progress

SUFFIX = ".zip"
LEAST_RUNS = 2


def pack_submission(folder: Path, out: Path) -> Path:
    """Write the submission of a folder of ``nlp-gait bench``, an archive as by ``pack_study``, and return it.

    Raises as ``pack_study``, and InputError if a record is no evidence, or a rule of ``check_rules`` is broken.
    """
    records, excluded = read_evidence(folder, "all")
    wrong = [exclusion.sentence for exclusion in excluded] + [f.sentence for f in check_rules(records) if not f.holds]
    if wrong:
        raise InputError(f"{str(folder)!r} cannot be submitted: {'; '.join(wrong)}")
    return pack_study(folder, records, out)


def verify_submission(path: Path, *, share: float, progress: Progress = ignore_progress) -> Verification:
    """Check a submission as ``verify_archive``, and the rules; its user code runs only if the caller has allowed it.

    Only a repeated run proves its history.
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
    counts = {len(own) for own in seeds.values()}
    equal = len(counts) == 1 and all(sorted(own) == list(range(len(own))) for own in seeds.values())
    enough = min(counts) >= LEAST_RUNS
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


def write_public_pages(
    folder: Path, out: Path, *, progress: Progress = ignore_progress
) -> tuple[list[Path], list[str]]:
    """Verify all submissions of a folder, and write the pages of those that hold; return the files and what was rejected.

    Submissions are ranked together if their instances and budgets are equal; a user's algorithm has its file's name in brackets.
    The first page is ``index.html``. ``progress`` is called with each file's name.
    """
    boards: dict[tuple[int, tuple[str, ...]], dict[tuple[str, str, int], RunRecord]] = {}
    rejected = []
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        progress(path.name)
        try:
            findings, records = verify_submission(path, share=0.0)
            wrong = "; ".join(finding.sentence for finding in findings if not finding.holds)
        except InputError as error:
            wrong = str(error)
        if wrong:
            rejected.append(f"{path.name}: {wrong}")
            continue
        key = (records[0].definition["stop"]["evaluations"], tuple(sorted({r.problem for r in records})))
        for record in records:
            if not isinstance(record.definition["solver"], str):  # user code
                record = replace(record, solver=f"{record.solver} ({_make_file_name(path.stem)})")
            boards.setdefault(key, {}).setdefault((record.solver, record.problem, record.run), record)
    pages, lines = list[Path](), list[str]()
    for (evaluations, instances), runs in sorted(boards.items()):
        for name, chosen in filter_instances(instances).items():
            written, line = _write_board(out, name, chosen, evaluations, list(runs.values()))
            pages += written
            lines.append(line)
    text = "\n".join(lines) or "No submission holds."
    rest = [Section(title="Rejected", parts=rejected)] if rejected else []
    index = Document(title="GaitBench: submissions", verdict=(), parts=(Prose(text), *rest))
    return [*write_document(out, index, "index"), *pages], rejected


def _write_board(
    out: Path, name: str, instances: Sequence[str], evaluations: int, records: Sequence[RunRecord]
) -> tuple[list[Path], str]:
    """Write a ranking and the page of each of its algorithms; also return its line of the index."""
    board = rank_solvers(instances, records, shipped=False)
    runs = max(record.run for record in records) + 1
    place = out / _make_file_name(f"{evaluations} {name} {hash_json(list(instances))[:8]}")
    make_folder(place)
    suite = f"{name}, {evaluations} evaluations"
    pages = write_document(place, make_leaderboard_page(board, None, suite, evaluations), "ranking")
    links = []
    for number, standing in enumerate(board.standings, start=1):
        page = _make_file_name(standing.solver)
        if len(board.standings) > 1:
            pages += write_document(place, make_leaderboard_page(board, standing.solver, suite, evaluations), page)
            links.append(f"{number}. [{standing.solver}]({place.name}/{page}.html)")
    title = f"{name}: {len(instances)} instances, {evaluations} evaluations, {runs} runs"
    return pages, f"- [{title}]({place.name}/ranking.html): {', '.join(links)}"


def _make_file_name(text: str) -> str:
    """Return the text if it is made of small letters, digits and single hyphens, otherwise what is left of it and its hash.

    So two texts have two names, on file systems that ignore case, too.
    """
    name = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
    return name if name == text else f"{name}-{hash_json(text)[:8]}".lstrip("-")
