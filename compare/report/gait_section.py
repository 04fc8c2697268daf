"""The figure of a report that shows the gaits themselves: the best of each solver."""

from __future__ import annotations

from compare.analysis.comparison import Comparison
from compare.drawing.gait_figure import DrawnGait, drawn_gait, gaits_figure
from compare.report.document import Figure
from compare.study.record import RunRecord
from compare.study.task import ProblemSpec
from nlp_gait.decoding import decoded
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import file_safe
from nlp_gait.problem import Result
from nlp_gait.problem.result import StoredProblem
from nlp_gait.references import named_as

CAPTION = (
    "Best gait of each solver: six poses of equal distance in time, later ones darker (left blue, right orange). Mechanical "
    "power is the sum of |torque x rate| over the joints. The balance margin is the distance of the zero-moment point from the "
    "nearest edge of the support polygon, negative outside of it."
)


def gaits_part(comparison: Comparison) -> Figure | str | None:
    """Best gait of each solver as a figure; a sentence where they cannot be drawn; None where nothing is feasible or moves."""
    best = [solver.best for solver in comparison.solvers]
    records = [record for record in best if record is not None]
    if not records:
        return None
    try:
        gaits = {record.algorithm: _gait(record) for record in records}
    except GaitError as error:
        return f"The gaits are not drawn: {error}."
    found = {title: gait for title, gait in gaits.items() if gait is not None}
    if not any(gait.skeleton is not None or gait.power is not None for gait in found.values()):
        return None
    return Figure(name=f"{file_safe(comparison.problem)}-gaits", caption=CAPTION, drawing=gaits_figure(found))


def _gait(record: RunRecord) -> DrawnGait | None:
    """A record's gait; None for a problem without time histories."""
    stored = decoded(StoredProblem, record.definition["problem"], "definition.problem")
    name = named_as(stored.name, "problem", f"the record of {record.algorithm}, run {record.run},")
    problem = ProblemSpec(name=name, options=stored.options, values=stored.parameters).load()
    if problem.motion is None:
        return None
    if set(record.x) != set(problem.names):
        raise InputError(f"{stored.name!r} has other variables than the record of {record.algorithm}, run {record.run}")
    return drawn_gait(Result(problem=problem, x=problem.check_x(record.x)))
