"""Report of a study from its records, the better points in it, and files for papers and other programs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.headline import MANY, write_overall_headline
from compare.analysis.record_statistics import TARGETS
from compare.analysis.units import name_solver
from compare.drawing.figures import save_figure, share_looks
from compare.judge import evaluate
from compare.report.document import Document, Figure, iterate_leaves
from compare.report.latex import describe_run_counts, escape_latex, format_latex_overview, format_latex_table
from compare.report.study_sections import (
    TESTS,
    list_costs,
    list_optimum,
    list_tests,
    load_gaits,
    load_problem_or_none,
    make_figure,
    make_folded_section,
    make_overview,
    make_problem_section,
    make_settings_section,
    split_title,
)
from compare.report.writing import write_document
from compare.study.record import COLUMNS, JUDGED, RunRecord, list_variables, load_gait, make_row
from compare.study.study import StudyFile, name_group, read_records, read_study_file
from nlp_gait.errors import InputError
from nlp_gait.files import format_csv, make_file_name, replace_nan, write_json, write_text

TableRows = Sequence[Sequence[object]]
"""Header and rows; None for an unknown value."""

MEASURED = ("n", "budget", "gap", "equivalent_evaluations")
COSTS = ("evaluations", "seconds")
# What the figures show that have no caption on the page, where a sentence and a legend are next to them.
CAPTIONS = {"final": "Final gap of each run; bar: median", "gaits": "Best gait from the side, later poses darker"}


@dataclass(frozen=True, kw_only=True)
class FurtherFiles:
    """Which files to write beside a study's report."""

    csv: bool = False  #: all runs, and the points of each problem; written again, too, where they exist already
    latex: bool = False  #: a table of each problem, and one of several problems and all solvers
    figures: bool = False  #: all figures of the report as PNG and as PDF, with their captions in LaTeX

    def write(self, folder: Path, comparisons: Sequence[Comparison], document: Document) -> list[Path]:
        """Write the files and return their paths; raises OutputError."""
        written = []
        if self.csv or (folder / "runs.csv").exists():
            tables = {"runs": make_runs_table(comparisons), **_make_point_tables(comparisons)}
            for name, rows in tables.items():
                written.append(write_text(folder / f"{name}.csv", format_csv(replace_nan(rows))))
        if self.figures:
            figures = [part for part in iterate_leaves(document.parts) if isinstance(part, Figure)]
            plots = [(figure.name, figure.plot()) for figure in figures]
            written += [save_figure(plot, folder / f"{name}.{kind}") for name, plot in plots for kind in ("png", "pdf")]
            written.append(write_text(folder / "figures.tex", _write_captions(figures, comparisons)))
        if self.latex:
            latex = {make_file_name(c.problem): format_latex_table(c) for c in comparisons}
            latex |= {"problems": format_latex_overview(comparisons)} if len(comparisons) > 1 else {}
            written += [write_text(folder / f"{name}-table.tex", table) for name, table in latex.items()]
        return written


def make_runs_table(comparisons: Sequence[Comparison]) -> TableRows:
    """Return all runs: ``COLUMNS``, dimension, budget, gap, equivalent evaluations, and costs to each target, empty if missed."""
    to_targets = [f"{axis}_to_{target:g}" for axis in COSTS for target in TARGETS]
    rows: list[Sequence[object]] = [(*COLUMNS, *MEASURED, *to_targets)]
    for comparison in comparisons:
        for solver in comparison.solvers:
            for record, curve, cost in zip(solver.records, solver.curves, solver.costs, strict=True):
                budget = record.inputs.evaluations
                measured = (len(record.x) or None, budget, comparison.gap(cost), curve.total_cost())
                reached = (curve.cost_to_reach(target, axis) for axis in COSTS for target in TARGETS)
                rows.append((*make_row(record), *measured, *reached))
    return replace_nan(rows)


def _make_point_tables(comparisons: Sequence[Comparison]) -> dict[str, TableRows]:
    """Return the final points of each problem with the judge's values, by the name of their file."""
    tables: dict[str, TableRows] = {}
    for comparison in comparisons:
        records = comparison.records
        names = list_variables(records)
        taken = {*names, *JUDGED}
        metrics = list(dict.fromkeys(name for r in records for name in r.metrics if name not in taken))
        tables[f"{make_file_name(comparison.problem)}-points"] = [
            ("solver", "run", *names, *JUDGED, *metrics),
            *(
                (r.solver, r.run, *map(r.x.get, names), *make_row(r, JUDGED), *map(r.metrics.get, metrics))
                for r in records
                if r.x
            ),
        ]
    return tables


def _write_captions(figures: Sequence[Figure], comparisons: Sequence[Comparison]) -> str:
    """Return all figures in LaTeX, each with what it shows."""
    text = ""
    for figure in figures:
        comparison = next((c for c in comparisons if figure.name.startswith(f"{make_file_name(c.problem)}-")), None)
        words = figure.caption.removesuffix(".") or CAPTIONS.get(figure.name.rpartition("-")[2], figure.name)
        if comparison is not None:
            words += f"; {comparison.problem}, {describe_run_counts(comparison)}"
        text += (
            f"\\begin{{figure}}\n\\centering\n\\includegraphics[width=\\linewidth]{{{figure.name}.pdf}}\n"
            f"\\caption{{{escape_latex(words)}.}}\n\\label{{fig:{figure.name}}}\n\\end{{figure}}\n"
        )
    return text


REPORT_ALONE = FurtherFiles()


def write_report(
    folder: Path,
    records: Sequence[RunRecord],
    file: StudyFile,
    *,
    further: FurtherFiles = REPORT_ALONE,
) -> list[Path]:
    """Write the report, its figures as SVG, and further files; return all paths."""
    comparisons = compare_problems(records, folder=folder)
    with share_looks({name_solver(record.solver) for record in records}):
        document = make_study_document(comparisons, file)
        written = write_document(folder, document)
        return [*written, *write_better_points(folder, comparisons), *further.write(folder, comparisons, document)]


def renew_report(folder: Path, further: FurtherFiles = REPORT_ALONE) -> tuple[list[RunRecord], list[str], list[Path]]:
    """Write the report of the records of a folder; return them, a sentence for each damaged one, and the files.

    Raises InputError if there are no records, or all are damaged.
    """
    records, damaged = read_records(folder)
    if not records:
        raise InputError(f"none of the {len(damaged)} records in {str(folder)!r} can be read: {damaged[0]}")
    return records, damaged, write_report(folder, records, read_study_file(folder), further=further)


def make_study_document(comparisons: Sequence[Comparison], file: StudyFile) -> Document:
    """Return the document of a study."""
    gaits = {comparison.problem: load_gaits(comparison) for comparison in comparisons}
    problems = {comparison.problem: load_problem_or_none(comparison) for comparison in comparisons}
    records = [record for comparison in comparisons for record in comparison.records]
    versions = dict.fromkeys(record.versions.get("nlp-gait", "unknown") for record in records)
    titles = {comparison.problem: split_title(comparison, problems[comparison.problem]) for comparison in comparisons}
    return Document(
        title=_write_title(list(titles.values()), len({solver.name for c in comparisons for solver in c.solvers})),
        parts=(
            *([f"{file.date[:10]}, v{', v'.join(versions)}: {file.command}"] if file.command else ()),
            *_describe_progress(file, records),
            *((write_overall_headline(comparisons), make_overview(comparisons)) if len(comparisons) >= MANY else ()),
            *(
                make_problem_section(c, titles[c.problem][0], problems[c.problem], gaits[c.problem])
                for c in comparisons
            ),
            make_folded_section("Convergence", comparisons, lambda c: (make_figure(c, "convergence"),)),
            make_folded_section("Cost to targets", comparisons, list_costs),
            make_folded_section("Significance", comparisons, list_tests, TESTS),
            make_folded_section(
                "Optimum: active constraints, prices" + (", gaits" if any(gaits.values()) else ""),
                comparisons,
                lambda c: list_optimum(c, gaits[c.problem]),
            ),
            make_settings_section(comparisons, file),
        ),
    )


def _write_title(titles: Sequence[tuple[str, str]], solvers: int) -> str:
    """Return the task and the objective, or what several problems have in common."""
    goals = {goal for _, goal in titles}
    if len(titles) == 1:
        return ": ".join(dict.fromkeys(word for word in titles[0] if word != "objective"))
    goal = goals.pop()
    return f"{solvers} solvers on {len(titles)} problems" if goals else f"{goal[:1].upper()}{goal[1:]}"


def _describe_progress(file: StudyFile, records: Sequence[RunRecord]) -> tuple[str, ...]:
    """Return a sentence while runs of the solvers in the report are missing."""
    groups = {name_group(record.problem, record.solver) for record in records}
    planned = sum(name.rsplit("-", 2)[0] in groups for name in file.runs)
    finished = len(records)
    return (f"{finished} of {planned} runs have ended; all numbers are of these.",) if finished < planned else ()


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
