"""Report of a study from its records, written once or while the study runs."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from compare.analysis.better_points import write_better_points
from compare.analysis.comparison import DEFAULT_WEIGHTING, Comparison, compare_problems, label_editions
from compare.analysis.overview import rank_over_problems, write_overall_verdict
from compare.analysis.record_statistics import Weighting
from compare.analysis.simulated_gaits import select_best_gaits
from compare.analysis.verdict import write_verdict
from compare.report.document import Document, Section, make_table_section, make_text_table
from compare.report.problem_section import HOW, make_problem_section
from compare.report.provenance import TERMS, format_settings, make_solver_table
from compare.report.solver_sections import make_overview
from compare.report.study_files import FurtherFiles
from compare.report.writing import make_citation_section, make_session_section, write_document
from compare.study.evidence import Exclusion, read_evidence
from compare.study.record import RunRecord
from compare.study.record_files import RECORDS
from compare.study.settings import Manifest, read_manifest
from compare.study.simulations import SimulatedGait, load_simulations
from nlp_gait.files import write_text

REPORT_ALONE = FurtherFiles()
RELOAD = '<head>\n<meta http-equiv="refresh" content="5">'  # seconds between reloads of the page
POLL_S = 2.0


def rebuild_report(
    folder: Path, weighting: Weighting = DEFAULT_WEIGHTING, further: FurtherFiles = REPORT_ALONE
) -> list[Path]:
    """Rewrite the report of all records of a folder, earlier ones included; return its files. Raises as ``read_evidence``."""
    evidence = read_evidence(folder)
    records, manifest = label_editions(evidence.records), read_manifest(folder)
    return write_report(folder, records, manifest, weighting, excluded=evidence.excluded, further=further)


def write_report(
    folder: Path,
    records: Sequence[RunRecord],
    manifest: Manifest,
    weighting: Weighting = DEFAULT_WEIGHTING,
    *,
    excluded: Sequence[Exclusion] = (),
    further: FurtherFiles = REPORT_ALONE,
) -> list[Path]:
    """Write the report with stored simulations, the figures as PNG and SVG, and further files; return all paths."""
    comparisons = compare_problems(records, weighting)
    simulated = load_simulations(folder, select_best_gaits(comparisons))
    document = make_study_document(comparisons, manifest, simulated, excluded)
    written = write_document(folder, document)
    return [*written, *write_better_points(folder, comparisons), *further.write(folder, comparisons)]


def watch_report(folder: Path, rewrite: Callable[[], object], sleep: Callable[[float], None] = time.sleep) -> None:
    """Rewrite the report of a folder after every change of its records until Ctrl-C; its page reloads itself meanwhile.

    ``rewrite`` writes the report. A folder without records is waited for.
    """
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
    simulated: Sequence[SimulatedGait] = (),
    excluded: Sequence[Exclusion] = (),
) -> Document:
    """Return the document of a study, of its best gaits simulated in the engine, and of excluded records."""
    sections = [make_problem_section(c, [gait for gait in simulated if gait.problem == c.problem]) for c in comparisons]
    sessions = [make_session_section(number, session) for number, session in enumerate(manifest.sessions, start=1)]
    ranking = rank_over_problems(comparisons) if len(comparisons) > 1 else None
    return Document(
        title="Comparison of solvers on " + ", ".join(c.problem for c in comparisons),
        verdict=write_overall_verdict(comparisons, ranking) if ranking else write_verdict(comparisons),
        parts=(
            *_list_excluded(excluded),
            TERMS,
            *((make_overview(comparisons, ranking),) if ranking else ()),
            *sections,
            *(() if simulated else (HOW,)),
            Section(title="Methods", parts=(*_describe_counting(comparisons), _list_settings(comparisons), *sessions)),
            make_citation_section(c.records[0].definition["problem"] for c in comparisons),
        ),
    )


def _list_excluded(excluded: Sequence[Exclusion]) -> tuple[Section, ...]:
    rows = [(exclusion.name, "; ".join(exclusion.reasons)) for exclusion in excluded]
    words = (
        "All numbers of records are evaluated again. These records are no evidence, and nothing below contains them."
    )
    return make_table_section("Excluded records", ("record", "reason"), rows, words, prose=True)


def _describe_counting(comparisons: Sequence[Comparison]) -> tuple[Section, ...]:
    sizes = [max((len(r.x) for r in c.records), default=0) for c in comparisons]
    rows = [
        (c.problem, *(f"{w:g}" for w in c.weighting.of_kind(n).values()))
        for c, n in zip(comparisons, sizes, strict=True)
    ]
    return make_table_section(
        "Counting",
        ("weight of a call", "f", "g", "gradient", "Jacobian", "Hessian"),
        rows,
        "Objective and constraints count separately where they are called separately, so gradient methods are never favoured. A "
        "gradient run reaches its targets at its end. A polished run includes the cost of its search. Times are wall times of "
        "the solve, without building or compiling.",
        "Searches with equal seeds start from the same points; run k has the study's seed plus k. The table of settings says "
        "what was changed; the defaults are those of the sources, and none was tuned on these problems.",
    )


def _list_settings(comparisons: Sequence[Comparison]) -> Section:
    problems = {c.problem: c.records[0].definition["problem"] for c in comparisons}
    rows = [
        (name, format_settings(problem["parameters"]) or "none", format_settings(problem["options"]))
        for name, problem in problems.items()
    ]
    solvers = make_solver_table(record for comparison in comparisons for record in comparison.records)
    return Section(
        title="Settings and seeds",
        parts=(solvers, make_text_table(("problem", "changed values", "options"), rows, prose=True)),
    )
