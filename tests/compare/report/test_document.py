"""Documents: what stands where on the page, in Markdown and in files; gaits are drawn, or why not is said."""

from dataclasses import replace
from pathlib import Path

import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.drawing.figures import make_figure
from compare.drawing.gait_figure import draw_gaits, make_gait_charts
from compare.report.document import Document, Figure, Prose, Section, Table
from compare.report.study_sections import load_gaits
from compare.report.writing import write_document
from tests.compare.records import DSP_X, record

POWERS = Table(
    columns={"solver": "", "power [W]": ".2f", "feasible": ""},
    rows=[["ga|<b>", 1 / 3, True], ["pso", None, False]],
    name="powers",
)


def made() -> Document:
    figure = Figure(name="empty", caption="Nothing, 0.1 times.", drawing=make_figure(1.0, 1.0))
    heading = Section(
        title="A heading of 3",
        parts=[Prose("| a | b |\n|---|---|\n| 1 | 2 |"), Section(title="Below it", parts=[figure])],
    )
    end = Section(title="The end", parts=[Prose("- one\n- two")])
    return Document(title="A title", parts=[Prose("Found 3 *gaits* 0.12."), POWERS, heading, end])


def test_pages_are_rounded_for_people_and_files_are_not(tmp_path: Path) -> None:
    files = write_document(tmp_path, made(), page="walk")
    assert [path.name for path in files] == ["walk.html", "walk.md", "powers.csv", "empty.svg"]
    page, markdown = (path.read_text(encoding="utf-8") for path in files[:2])
    assert "| ga\\|&lt;b&gt; | 0.33 | yes | \n" in markdown and "| pso | - | no |" in markdown
    assert "## A heading of 3\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n### Below it\n\n![empty](empty.svg)" in markdown
    assert "<td>0.33</td>" in page and "<td>-</td>" in page
    assert "<em>gaits</em>" in page and "<li>two</li>" in page and "<td>2</td>" in page
    assert page.count("<svg") == 1 and 'class="headline"' not in page
    assert files[2].read_text() == f"solver,power [W],feasible\nga|<b>,{1 / 3!r},true\npso,,false\n"


def test_markup_in_the_programs_own_text_is_no_html(tmp_path: Path) -> None:
    write_document(tmp_path, Document(title="<b>", parts=[Prose("**strong** <script>x</script>")]))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<strong>strong</strong> &lt;script&gt;x" in page and "<b>" not in page


def comparison(name: str, x: dict[str, float], *solvers: str) -> Comparison:
    records = [record(solver, 0, [(1, 0.5)], problem="dsp") for solver in solvers]
    stored = {"name": name, "options": {}, "parameters": {}}
    changed = [replace(r, x=x, inputs=replace(r.inputs, problem=stored)) for r in records]
    return compare_problems(changed)[0]


def test_the_best_gait_is_drawn_with_curves_of_all() -> None:
    gaits = load_gaits(comparison("nao-dsp", DSP_X, "pso", "ga"))
    assert not isinstance(gaits, str)
    charts = make_gait_charts(gaits)
    assert [len(chart.series) for chart in charts] == [2, 2]
    assert [chart.y for chart in charts] == ["mechanical power [W]", "balance margin [mm]"]
    (poses,) = draw_gaits(gaits, curves=False)
    assert all(f">{words}</text>" in poses.to_svg() for words in ("left leg", "right leg"))


@pytest.mark.parametrize(
    ("name", "x", "why"),
    [
        ("nao-dsp", {"a": 1.0}, "must name every variable once"),
        ("never.py:seen", {"a": 1.0}, "never.py"),
    ],
)
def test_what_cannot_be_drawn_is_reported(name: str, x: dict[str, float], why: str) -> None:
    """Code that a record names is not run for it."""
    part = load_gaits(comparison(name, x, "pso"))
    assert isinstance(part, str) and part.startswith("The gaits are not drawn: ") and why in part
