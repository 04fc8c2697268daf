"""Report of a study from its records, and the better points in it."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.headline import MANY, write_overall_headline
from compare.analysis.units import name_solver
from compare.drawing.figures import share_looks
from compare.judge import evaluate
from compare.report.document import Document, Section, make_table_section
from compare.report.study_files import FurtherFiles
from compare.report.study_sections import (
    TESTS,
    list_convergence,
    list_costs,
    list_optimum,
    list_tests,
    load_gaits,
    load_problem_or_none,
    make_folded_section,
    make_overview,
    make_problem_section,
    make_settings_section,
    split_title,
)
from compare.report.writing import write_document
from compare.study.evidence import CheckedRecords, Exclusion, read_evidence
from compare.study.record import RunRecord, load_gait
from compare.study.record_files import RECORDS, name_group
from compare.study.settings import Manifest, Session, read_manifest
from nlp_gait.files import make_file_name, replace_nan, write_json, write_text

REPORT_ALONE = FurtherFiles()
RELOAD = '<head>\n<meta http-equiv="refresh" content="5">'  # seconds between reloads of the page
POLL_S = 2.0


def write_report(
    folder: Path,
    records: Sequence[RunRecord],
    manifest: Manifest,
    *,
    excluded: Sequence[Exclusion] = (),
    further: FurtherFiles = REPORT_ALONE,
) -> list[Path]:
    """Write the report with stored simulations, its figures as SVG, and further files; return all paths."""
    comparisons = compare_problems(records)
    with share_looks({name_solver(record.solver) for record in records}):
        document = make_study_document(comparisons, manifest, excluded)
        written = write_document(folder, document)
        return [*written, *write_better_points(folder, comparisons), *further.write(folder, comparisons, document)]


def renew_report(folder: Path, further: FurtherFiles = REPORT_ALONE) -> tuple[CheckedRecords, list[Path]]:
    """Check the records of a folder, write its report, and return both; raises as ``read_evidence``."""
    evidence, manifest = read_evidence(folder), read_manifest(folder)
    return evidence, write_report(folder, evidence.records, manifest, excluded=evidence.excluded, further=further)


def watch_report(folder: Path, rewrite: Callable[[], object], sleep: Callable[[float], None] = time.sleep) -> None:
    """Rewrite the report of a folder after every change of its records until Ctrl-C; the open page reloads itself."""
    page, shown = folder / "report.html", None
    try:
        while True:
            records = {path: path.stat().st_mtime_ns for path in (folder / RECORDS).glob("*/*.json")}
            if records and records != shown:
                rewrite()
                write_text(page, page.read_text(encoding="utf-8").replace("<head>", RELOAD, 1))
                shown = records
            sleep(POLL_S)
    except KeyboardInterrupt:
        return


def make_study_document(
    comparisons: Sequence[Comparison],
    manifest: Manifest,
    excluded: Sequence[Exclusion] = (),
) -> Document:
    """Return the document of a study, and of excluded records."""
    gaits = {comparison.problem: load_gaits(comparison) for comparison in comparisons}
    problems = {comparison.problem: load_problem_or_none(comparison) for comparison in comparisons}
    titles = {comparison.problem: split_title(comparison, problems[comparison.problem]) for comparison in comparisons}
    return Document(
        title=_write_title(list(titles.values()), len({solver.name for c in comparisons for solver in c.solvers})),
        parts=(
            *_describe_latest(manifest.sessions),
            *_describe_progress(manifest, [r for c in comparisons for r in c.records], len(excluded)),
            *_list_excluded(excluded),
            *((write_overall_headline(comparisons), make_overview(comparisons)) if len(comparisons) >= MANY else ()),
            *(
                make_problem_section(c, titles[c.problem][0], problems[c.problem], gaits[c.problem])
                for c in comparisons
            ),
            make_folded_section("Convergence", comparisons, list_convergence),
            make_folded_section("Cost to targets", comparisons, list_costs),
            make_folded_section("Significance", comparisons, list_tests, TESTS),
            make_folded_section(
                "Optimum: active constraints, prices, gaits",
                comparisons,
                lambda c: list_optimum(c, gaits[c.problem]),
            ),
            make_settings_section(comparisons, manifest.sessions),
        ),
    )


def _write_title(titles: Sequence[tuple[str, str]], solvers: int) -> str:
    """Return the task and the objective, or what several problems have in common."""
    goals = {goal for _, goal in titles}
    if len(titles) == 1:
        return ": ".join(titles[0])
    goal = goals.pop()
    return f"{solvers} solvers on {len(titles)} problems" if goals else f"{goal[:1].upper()}{goal[1:]}"


def _describe_latest(sessions: Sequence[Session]) -> tuple[str, ...]:
    """Return date, version and command of the latest session."""
    if not sessions:
        return ()
    session = sessions[-1]
    return (f"{session.started[:10]}, version {session.versions.get('nlp-gait', 'unknown')}: {session.command}",)


def _describe_progress(manifest: Manifest, records: Sequence[RunRecord], excluded: int) -> tuple[str, ...]:
    """Return a sentence while runs of the latest command, or of the solvers in the report, are missing."""
    shown = {(record.problem, record.solver) for record in records}
    if manifest.settings is not None:
        shown |= {(task.problem.title, task.title) for task in manifest.settings.tasks()}
    groups = {name_group(*titles) for titles in shown}
    planned = sum(name.rsplit("-", 2)[0] in groups for name in manifest.runs)
    finished = len(records) + excluded
    return (f"{finished} of {planned} runs have ended; all numbers are of these.",) if finished < planned else ()


def _list_excluded(excluded: Sequence[Exclusion]) -> tuple[Section, ...]:
    rows = [(exclusion.name, "; ".join(exclusion.reasons)) for exclusion in excluded]
    words = (
        "All numbers of records are evaluated again. These records are no evidence, and nothing below contains them."
    )
    return make_table_section("Excluded records", ("record", "reason"), rows, words, prose=True)


def write_better_points(folder: Path, comparisons: Sequence[Comparison]) -> list[Path]:
    """Judge every run that is better than the best known value again, write it as a result, and return the files.

    A file ``better-<problem>.json`` can be read by every command that reads the result of ``solve --out``.
    """
    written = []
    for comparison in comparisons:
        run = comparison.better
        if run is None:
            continue
        gait = load_gait(run)
        evaluation = evaluate(gait.problem, gait.x)
        if evaluation.feasible and comparison.known.is_beaten_by(evaluation.objective["value"], comparison.objective):
            best = {"objective": comparison.reference, "source": comparison.known.source}
            origin = {"solver": run.solver, "run": run.run, "seed": run.seed, "settings": run.settings}
            path = folder / f"better-{make_file_name(comparison.problem)}.json"
            write_json(path, replace_nan({**evaluation.to_json(), "found_by": origin, "best_known_before": best}))
            written.append(path)
    return written
