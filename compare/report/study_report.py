"""Report of a study from its records, written once or while the study runs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from compare.analysis.comparison import DEFAULT_WEIGHTING, Comparison, compare_problems, label_editions
from compare.analysis.overview import (
    Ranking,
    count_wins,
    describe_tests,
    list_user_solvers,
    rank_over_problems,
    write_overall_verdict,
)
from compare.analysis.published import write_better_points
from compare.analysis.record_statistics import Weighting
from compare.analysis.simulated_gaits import select_best_gaits
from compare.analysis.tuning import Tuning, read_tunings
from compare.analysis.verdict import find_leaders, write_verdict
from compare.drawing.comparison_figures import list_expected_costs, plot_performance_profile
from compare.report.document import Document, Figure, Part, Section, Table, list_section, text_table
from compare.report.problem_section import HOW, problem_section
from compare.report.provenance import TERMS, format_settings, make_solver_table
from compare.report.solver_sections import make_anytime_section, make_tuning_section
from compare.report.study_files import FurtherFiles
from compare.report.writing import make_citation_section, make_session_section, write_document
from compare.study.evidence import Exclusion, read_evidence
from compare.study.record import RunRecord
from compare.study.record_files import RECORDS
from compare.study.settings import Manifest, read_manifest
from compare.study.simulations import SimulatedGait, load_simulations
from nlp_gait.files import write_text


def make_overview(comparisons: Sequence[Comparison], ranking: Ranking) -> Section:
    """Return the section on all problems of a study together."""
    parts: list[Part] = [
        "Median gap to the best known value over all runs. A star marks the best median and those that do not differ from it "
        "significantly (rank-sum test at 5 %, Holm-corrected over all pairs on the problem). Ranks are those of the medians, of "
        f"solvers that ran on all problems; equals share a rank. {describe_tests(ranking)}".strip(),
        _make_matrix(comparisons, ranking.mean_ranks),
        *(_make_wins(comparisons, solver) for solver in list_user_solvers(comparisons)),
    ]
    if list_expected_costs(comparisons):
        parts.append(
            Figure(
                name="performance-profile",
                caption="Share of problems and targets that a solver reaches within a factor of the cheapest one's expected "
                "evaluations.",
                drawing=plot_performance_profile(comparisons),
            )
        )
    if ranking.mean_ranks:
        parts.append(make_anytime_section(comparisons))
    return Section(title="All problems", parts=parts)


def _make_matrix(comparisons: Sequence[Comparison], ranks: Mapping[str, float]) -> Table:
    names = list(dict.fromkeys([*ranks, *(solver.name for c in comparisons for solver in c.solvers)]))
    rows = []
    for comparison in comparisons:
        leaders, medians = find_leaders(comparison), {s.name: s.median_cost for s in comparison.solvers}
        rows.append((comparison.problem, *(_format_cell(comparison, name, medians, leaders) for name in names)))
    rows.append(("mean rank", *(f"{ranks[name]:.2f}" if name in ranks else "-" for name in names)))
    return text_table(("problem", *names), rows, "Median gap of each solver on each problem")


def _format_cell(comparison: Comparison, name: str, medians: dict[str, float], leaders: set[str]) -> str:
    if name not in medians:
        return "-"
    gap = comparison.gap(medians[name])
    return f"{comparison.format_gap(gap)}{' *' if name in leaders else ''}" if math.isfinite(gap) else "infeasible"


def _make_wins(comparisons: Sequence[Comparison], solver: str) -> Table:
    rows = [(r.other, str(r.wins), str(r.ties), str(r.losses)) for r in count_wins(comparisons, solver)]
    caption = f"Problems on which {solver} is significantly better, not different, or worse"
    return text_table(("against", "wins", "ties", "losses"), rows, caption)


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
    document = make_study_document(comparisons, manifest, simulated, excluded, read_tunings(folder))
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
    tunings: Sequence[Tuning] = (),
) -> Document:
    """Return the document of a study, of its best gaits simulated in the engine, of excluded records, and of tuned searches."""
    sections = [problem_section(c, [gait for gait in simulated if gait.problem == c.problem]) for c in comparisons]
    sessions = [make_session_section(number, session) for number, session in enumerate(manifest.sessions, start=1)]
    ranking = rank_over_problems(comparisons) if len(comparisons) > 1 else None
    return Document(
        title="Comparison of solvers on " + ", ".join(c.problem for c in comparisons),
        verdict=write_overall_verdict(comparisons, ranking) if ranking else write_verdict(comparisons),
        parts=(
            *_list_excluded(excluded),
            TERMS,
            *((make_overview(comparisons, ranking),) if ranking else ()),
            *make_tuning_section(tunings),
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
    return list_section("Excluded records", ("record", "reason"), rows, words, prose=True)


def _describe_counting(comparisons: Sequence[Comparison]) -> tuple[Section, ...]:
    sizes = [max((len(r.x) for r in c.records), default=0) for c in comparisons]
    rows = [
        (c.problem, *(f"{w:g}" for w in c.weighting.of_kind(n).values()))
        for c, n in zip(comparisons, sizes, strict=True)
    ]
    return list_section(
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
        parts=(solvers, text_table(("problem", "changed values", "options"), rows, prose=True)),
    )
