"""Static pages of all verified submissions: rankings by family, dimension and budget, and a page for each algorithm."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from compare.bench.leaderboard import filter_instances, rank_solvers
from compare.bench.page import make_leaderboard_page
from compare.bench.submission import SUFFIX, verify_submission
from compare.report.document import Document, Prose, Section
from compare.report.writing import write_document
from compare.study.record import RunRecord
from nlp_gait.backends.identity import hash_json
from nlp_gait.errors import InputError
from nlp_gait.files import make_folder
from nlp_gait.progress import Progress, ignore_progress


def write_public_pages(
    folder: Path, out: Path, *, progress: Progress = ignore_progress
) -> tuple[list[Path], list[str]]:
    """Verify all submissions of a folder, and write the pages of those that hold; return the files and what was rejected.

    Submissions are ranked together if their instances and budgets are equal; a user's algorithm has its file's name in brackets.

    Args:
        folder: with ``*.zip`` of ``nlp-gait bench --submit``.
        out: of the pages; the first one is ``index.html``.
        progress: called with each file's name.
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
