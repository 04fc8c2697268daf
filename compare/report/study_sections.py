"""Sections of a study's report: what is seen first of each problem, and the headings that open on demand."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

from compare.analysis.columns import EFFORT, EVALUATIONS_TO, JUDGEMENT, MAIN, SECONDS_TO, Column, format_rows
from compare.analysis.comparison import Comparison, describe_tests, explain_marks, rank_over_problems, tabulate_problems
from compare.analysis.headline import describe_unknown, write_headline
from compare.analysis.units import BY_UNIT, name_in_words, name_solver, with_unit
from compare.drawing.charts import Chart, draw_chart, make_convergence_charts, make_ecdf_charts, make_final_gap_charts
from compare.drawing.gait_figure import GaitCurves, draw_gaits, make_gait_charts, prepare_gait
from compare.report.document import Figure, Part, Prose, Section, Table, make_table_section, make_text_table
from compare.report.interactive import describe_gaits
from compare.report.provenance import TERMS, format_settings, make_solver_table
from compare.report.writing import escape_markdown, make_anchor, make_version_table
from compare.study.record import find_best, load_gait, load_problem
from compare.study.study import StudyFile
from nlp_gait.errors import GaitError
from nlp_gait.files import make_file_name
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import ActiveConstraint

SHOWN_CONSTRAINTS = 15
SHOWN_VARIABLES = 12  # of the best design
HOW_PROVEN = "How it is proven"
SCALES = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "rad": (180.0 / math.pi, "deg"), "rad/s": (180.0 / math.pi, "deg/s")}
# Figures of a problem by name: the function from its comparison to charts, and the caption.
FIGURES = {
    "final": (make_final_gap_charts, ""),
    "convergence": (
        make_convergence_charts,
        "Best so far: bands from best to worst run, lines are medians; a gradient run is a point at its end. Gaps below 1e-6 % "
        "are drawn at that value.",
    ),
    "runtime": (
        lambda comparison: make_ecdf_charts([comparison]),
        "Share of pairs of run and target solved within a cost; 31 targets, 100 % to 1e-4 % above the best known.",
    ),
}


def load_problem_or_none(comparison: Comparison) -> GaitProblem | None:
    """Return the problem of a comparison; None if it cannot be loaded, as user code that the command does not name."""
    try:
        return load_problem(comparison.records[0])
    except GaitError:
        return None


def split_title(comparison: Comparison, problem: GaitProblem | None) -> tuple[str, str]:
    """Return the task and the objective in words: ``NAO on one leg`` and ``mean motor power``."""
    name, objective = comparison.problem, comparison.objective.name
    if problem is None or problem.name != name:
        return name, objective
    task, _, goal = problem.title.partition(": ")
    return task, goal or objective


def make_problem_section(
    comparison: Comparison, title: str, problem: GaitProblem | None, gaits: Mapping[str, GaitCurves] | str
) -> Section:
    """Return what is seen first; ``gaits`` are those of ``load_gaits``."""
    sentence = escape_markdown(write_headline(comparison))
    link = sentence.replace("proven", f"[proven](#{make_anchor(HOW_PROVEN)})", 1)
    parts: list[Part] = [Prose(link), make_figure(comparison, "final")]
    if isinstance(gaits, str):
        parts.append(gaits)
    elif any(gait.skeleton is not None for gait in gaits.values()):
        parts.append(
            Figure(
                name=f"{make_file_name(comparison.problem)}-gaits",
                caption="",
                drawing=partial(draw_gaits, gaits, curves=False),
                gaits=describe_gaits(gaits),
            )
        )
    parts += [*list_design(comparison, problem), make_statistics_table(comparison, MAIN)]
    return Section(title=title, parts=parts, half=True)


def list_design(comparison: Comparison, problem: GaitProblem | None) -> tuple[Part, ...]:
    """Return the objective and the variables of the best point with their units."""
    best = comparison.best
    if best is None:
        return ()
    units = {} if problem is None else {variable.name: variable.unit for variable in problem.variables}
    objective = comparison.objective
    rows = [(objective.name.replace("_", " "), with_unit(best.objective, objective.unit))]
    for name, value in list(best.x.items())[:SHOWN_VARIABLES]:
        unit = units.get(name, "1")
        scale, shown = SCALES.get(unit, (1.0, unit))
        rows.append((name_in_words(name, unit), with_unit(scale * value, shown, ".4g")))
    more = len(best.x) - SHOWN_VARIABLES
    if more > 0:
        rows.append((f"and {more:,} more", "report --csv"))
    return (make_text_table(("best design", name_solver(best.solver)), rows),)


def make_figure(comparison: Comparison, name: str) -> Part:
    """Return one of ``FIGURES``, or a sentence where no run has costs to draw."""
    compute, caption = FIGURES[name]
    charts = compute(comparison)
    if not charts:
        return "The evaluations and times of all runs are unknown."
    return make_chart_figure(f"{make_file_name(comparison.problem)}-{name}", caption, charts)


def make_chart_figure(name: str, caption: str, charts: Sequence[Chart]) -> Figure:
    """Return the figure of charts."""
    return Figure(name=name, caption=caption, drawing=[draw_chart(chart) for chart in charts])


def make_statistics_table(comparison: Comparison, columns: tuple[Column, ...], caption: str = "") -> Table:
    """Return a table with a row for each solver, the best median first."""
    return make_text_table(*format_rows(comparison, columns), caption)


def load_gaits(comparison: Comparison) -> dict[str, GaitCurves] | str:
    """Return the best gait of each solver, the best of all first, then the user's; or why they are not drawn."""
    solvers = sorted(
        (solver for solver in comparison.solvers if solver.best is not None),
        key=lambda solver: (solver.best is not comparison.best, not solver.is_user_defined),
    )
    try:
        results = {solver.title: load_gait(solver.best) for solver in solvers if solver.best is not None}
        return {name: prepare_gait(gait) for name, gait in results.items() if gait.problem.display.motion is not None}
    except GaitError as error:
        return f"The gaits are not drawn: {error}."


def make_folded_section(
    title: str,
    comparisons: Sequence[Comparison],
    make_parts: Callable[[Comparison], Iterable[Part]],
    *ending: Part,
) -> Section:
    """Return a section that opens on demand, with a section for each of several problems."""
    if len(comparisons) == 1:
        return Section(title=title, parts=(*make_parts(comparisons[0]), *ending), folded=True)
    sections = [Section(title=c.problem, parts=parts) for c in comparisons if (parts := tuple(make_parts(c)))]
    return Section(title=title, parts=(*sections, *ending), folded=True)


def list_costs(comparison: Comparison) -> tuple[Part, ...]:
    """Return the expected running times to targets, the effort, and the failed runs."""
    return (
        make_figure(comparison, "runtime"),
        *describe_unknown(comparison),
        make_statistics_table(
            comparison,
            (*EVALUATIONS_TO, *SECONDS_TO),
            "Expected running time: cost of all runs until the target, divided by the number that reached it. It is a mean: one "
            "long run raises it",
        ),
        make_statistics_table(
            comparison, EFFORT, "Medians of a run; build and compile are the longest, once for each process"
        ),
        *_list_failures(comparison),
    )


def _list_failures(comparison: Comparison) -> tuple[Section, ...]:
    rows = [
        (name_solver(r.solver), str(r.run), str(r.seed), r.status, "; ".join(r.violated[:5]) or "-")
        for r in comparison.records
        if not r.feasible or r.feasible_between_samples is False
    ]
    header = ("solver", "run", "seed", "status", "violated, worst first, at the samples or between them")
    return make_table_section("Runs that failed or violate a limit", header, rows, prose=True)


def list_tests(comparison: Comparison) -> tuple[Part, ...]:
    """Return the tests of all pairs of solvers, and whether they can show anything."""
    pairs = [(f"{name_solver(p.first)} < {name_solver(p.second)}", p) for p in comparison.pairs]
    rows = [(words, _format_p(p.rank_sum), f"{p.a12:.3f}") for words, p in pairs]
    power = (f"{comparison.power[:1].upper()}{comparison.power[1:]}.",) if comparison.power else ()
    return (*power, make_text_table(("better median < other", "rank-sum p", "A12"), rows)) if rows else ()


TESTS = (
    "Two-sided p-values of the rank-sum test on the final objectives of all runs, Holm-corrected over all pairs. A12 is the "
    "probability that a run of the first solver ends better (0.5: no difference; above 0.71: large)."
)


def _format_p(value: float) -> str:
    return f"{value:.4f}" if value >= 1e-4 else f"{value:.1e}"


def list_optimum(comparison: Comparison, gaits: Mapping[str, GaitCurves] | str) -> tuple[Part, ...]:
    """Return active constraints with prices, the gaits over time, and limits between the samples."""
    charts = [] if isinstance(gaits, str) or not gaits else make_gait_charts(gaits)
    caption = (
        "Best gait of each solver. Mechanical power is the sum of |torque x rate| over the joints. The balance margin is the "
        "distance of the zero-moment point from the nearest edge of the support polygon, negative outside of it."
    )
    how = "`nlp-gait simulate RECORD.json` simulates a run's gait in MuJoCo (extra `sim`)."
    drawn = (make_chart_figure(f"{make_file_name(comparison.problem)}-curves", caption, charts), Prose(how))
    return (*_list_active(comparison), *(drawn if charts else ()))


def _list_active(comparison: Comparison) -> tuple[Section, ...]:
    record = find_best(record for record in comparison.records if record.active_constraints)
    if record is None:
        return ()
    rows = [
        (
            active.name,
            active.side,
            f"{active.bound:g} {active.unit}",
            f"{active.price:.4g} {active.price_unit}",
            _describe_step(active, comparison.objective.unit),
        )
        for active in record.active_constraints[:SHOWN_CONSTRAINTS]
    ]
    left_out = len(record.active_constraints) - len(rows)
    note = f" {left_out} lower ones are omitted." if left_out else ""
    return make_table_section(
        "Active constraints",
        ("constraint", "side", "at", "price", "for a step"),
        rows,
        f"At the best optimum of {name_solver(record.solver)} (run {record.run}). The price is the change of the optimal "
        f"{comparison.objective.name} per unit by which the bound is raised, highest first.{note}",
    )


def _describe_step(active: ActiveConstraint, unit: str) -> str:
    """Return for example ``+0.0237 W for 1 mm``."""
    step = BY_UNIT.get(active.unit)
    if step is None:
        return "-"
    return f"{active.price * step.size:+z.4f}{'' if unit == '1' else f' {unit}'} for {step.words}"


def make_settings_section(comparisons: Sequence[Comparison], file: StudyFile) -> Section:
    """Return what the solvers report, how costs are counted, all settings, versions and terms."""
    problems = {c.problem: c.records[0].inputs.problem for c in comparisons}
    options = [
        (name, format_settings(problem["parameters"]) or "none", format_settings(problem["options"]))
        for name, problem in problems.items()
    ]
    return make_folded_section(
        "Settings and provenance",
        comparisons,
        lambda c: (make_statistics_table(c, JUDGEMENT, "Reported by the solvers, and found by the judge"),),
        Section(title=HOW_PROVEN, parts=[f"{c.problem}: {c.known.source}." for c in comparisons]),
        "Reported is what the solvers say. Everything else is what the judge finds with the exact functions at the reported "
        "point. Searches with equal seeds start from the same points; run k has the study's seed plus k. Defaults are those of "
        "the sources; none was tuned on these problems.",
        make_solver_table(record for comparison in comparisons for record in comparison.records),
        make_text_table(("problem", "changed values", "options"), options, prose=True),
        "Objective and constraints count separately where they are called separately, so gradient methods are never favoured; a "
        "gradient run reaches its targets at its end. Times are wall times of "
        "the solve, without building or compiling.",
        make_version_table(file.command, file.date, (r.versions for c in comparisons for r in c.records)),
        TERMS,
    )


def make_overview(comparisons: Sequence[Comparison]) -> Section:
    """Return the section on all problems of a study together."""
    subject, (header, *rows) = tabulate_problems(comparisons)
    words = f"{explain_marks(subject)} {describe_tests(rank_over_problems(comparisons))}".strip()
    return Section(title="All problems", parts=[words, make_text_table(header, rows)])
