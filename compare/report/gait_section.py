"""The figure of a report with the best gait of each solver."""

from __future__ import annotations

from compare.analysis.comparison import Comparison
from compare.drawing.gait_figure import GaitCurves, plot_gaits, prepare_gait
from compare.report.document import Figure
from compare.study.record import RunRecord, load_gait
from nlp_gait.errors import GaitError
from nlp_gait.files import make_file_name

CAPTION = (
    "Best gait of each solver: six poses at equidistant times, later ones darker (left blue, right orange). Mechanical "
    "power is the sum of |torque x rate| over the joints. The balance margin is the distance of the zero-moment point from the "
    "nearest edge of the support polygon, negative outside of it."
)


def make_gaits_part(comparison: Comparison) -> Figure | str | None:
    """Return the best gait of each solver as a figure, a sentence if they cannot be drawn, or None without any gait."""
    best = [solver.best for solver in comparison.solvers]
    records = [record for record in best if record is not None]
    if not records:
        return None
    try:
        gaits = {record.solver: _gait(record) for record in records}
    except GaitError as error:
        return f"The gaits are not drawn: {error}."
    found = {title: gait for title, gait in gaits.items() if gait is not None}
    if not any(gait.skeleton is not None or gait.power is not None for gait in found.values()):
        return None
    return Figure(name=f"{make_file_name(comparison.problem)}-gaits", caption=CAPTION, drawing=plot_gaits(found))


def _gait(record: RunRecord) -> GaitCurves | None:
    """Return a record's gait, or None for a problem without time histories."""
    gait = load_gait(record)
    return None if gait.problem.display.motion is None else prepare_gait(gait)
