"""Documents: what stands where on the page, in Markdown and in the files beside it."""

from pathlib import Path

from compare.drawing.figures import make_figure
from compare.report.document import Document, Figure, Prose, Section, Table
from compare.report.writing import write_document

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
