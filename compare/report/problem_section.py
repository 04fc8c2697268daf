"""The first screen of a report on one problem: the gap of every run, the best gait, the table of solvers."""

from collections.abc import Mapping, Sequence
from functools import partial

from compare.analysis.columns import MAIN, Column, format_rows
from compare.analysis.comparison import Comparison
from compare.drawing.charts import Chart, draw_charts, encode_charts
from compare.drawing.comparison_figures import make_convergence_charts, make_ecdf_charts, make_final_gap_charts
from compare.drawing.gait_figure import GaitCurves, draw_gaits, prepare_gait
from compare.report.document import Figure, Part, Section, Table, make_text_table
from compare.report.interactive import describe_gaits
from compare.study.record import load_gait
from nlp_gait.errors import GaitError
from nlp_gait.files import make_file_name

# Figures of a problem by name: the function from its comparison to charts, and the caption.
FIGURES = {
    "final": (make_final_gap_charts, "Bar: median; dotted: tolerance."),
    "convergence": (
        make_convergence_charts,
        "Best so far: bands from best to worst run, lines are medians; a gradient run is a point at its end. Gaps below 1e-6 % "
        "are drawn at that value.",
    ),
    "runtime": (
        make_ecdf_charts,
        "Share of pairs of run and target solved within a cost; 31 targets, 100 % to 1e-4 % above the best known.",
    ),
}


def make_problem_section(comparison: Comparison, gaits: Mapping[str, GaitCurves] | str) -> Section:
    """Return what is seen first; ``gaits`` are those of ``load_gaits``."""
    parts: list[Part] = [make_figure(comparison, "final")]
    if isinstance(gaits, str):
        parts.append(gaits)
    elif any(gait.skeleton is not None for gait in gaits.values()):
        parts.append(
            Figure(
                name=f"{make_file_name(comparison.problem)}-gaits",
                caption="Best gait.",
                drawing=partial(draw_gaits, gaits, curves=False),
                data=describe_gaits(gaits, curves=False),
            )
        )
    return Section(title=comparison.problem, parts=(*parts, make_statistics_table(comparison, MAIN)))


def make_figure(comparison: Comparison, name: str) -> Figure:
    """Return one of ``FIGURES``."""
    compute, caption = FIGURES[name]
    charts = compute(comparison)
    stem = f"{make_file_name(comparison.problem)}-{name}"
    return make_chart_figure(stem, caption, charts)


def make_chart_figure(name: str, caption: str, charts: Sequence[Chart], columns: int = 2) -> Figure:
    """Return the figure of charts, which the page draws itself."""
    return Figure(
        name=name,
        caption=caption,
        drawing=partial(draw_charts, charts, columns),
        data=encode_charts(charts),
    )


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
        results = {solver.name: load_gait(solver.best) for solver in solvers if solver.best is not None}
        return {name: prepare_gait(gait) for name, gait in results.items() if gait.problem.display.motion is not None}
    except GaitError as error:
        return f"The gaits are not drawn: {error}."
