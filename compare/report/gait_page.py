"""One gait as a page of its own: in 3-D, with power and balance margin; also shown in notebooks."""

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

from compare.drawing.figures import render_svg
from compare.drawing.gait_figure import plot_gaits, prepare_gait
from compare.report.document import Document, Figure
from compare.report.interactive import describe_gaits
from compare.report.writing import html
from nlp_gait.errors import InputError
from nlp_gait.files import write_text
from nlp_gait.formulation import Array, GaitProblem, Result

CAPTION = "Left blue, right orange; the support polygon green, the zero-moment point pink, the centre of mass in ink."


@dataclass(frozen=True)
class GaitPage:
    """A page that plays a gait; notebooks display it."""

    html: str  #: the whole page, without any other file

    def write(self, path: Path) -> None:
        """Write the page; raises OutputError."""
        write_text(path, self.html)

    def _repr_html_(self) -> str:
        frame = 'sandbox="allow-scripts" title="gait in 3-D" style="width: 100%; height: 52rem; border: 0"'
        return f'<iframe srcdoc="{escape(self.html)}" {frame}></iframe>'


def animate_gait(problem: GaitProblem, x: Array | Mapping[str, float], name: str) -> GaitPage:
    """Return the page of a gait, a point x of a problem, under the name of its solver; InputError if it cannot be drawn."""
    gaits = {name: prepare_gait(Result(problem=problem, x=problem.check_x(x)))}
    data = describe_gaits(gaits)
    if data is None:
        raise InputError(f"problem {problem.name!r} has no skeleton to draw")
    drawing = plot_gaits(gaits)
    figure = Figure(name="gait", caption=CAPTION, drawing=drawing, data=data)
    return GaitPage(html(Document(title=problem.title, parts=[figure]), [render_svg(drawing)]))
