"""A user's own words on the terminal, in reports and in figures: shown, never obeyed."""

import io
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

from compare.analysis.comparison import compare_problems
from compare.cli import command
from compare.cli.command import PlainConsole, escape_controls
from compare.drawing.figures import inline_svg, make_figure, render_svg, use_style
from compare.report.study_report import make_study_document
from compare.report.writing import render_markdown, render_page
from compare.study.study import StudyFile
from tests.compare.records import study

SCRIPT = "<script>alert(1)</script>"
QUOTED = "\"><img src=x onerror='alert(1)'>"
MARKED = f"{SCRIPT}{QUOTED}[link](javascript:alert(1)) | `x` \x1b[31m"


class Page(HTMLParser):
    """Tags and attributes of a page, and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text += data


def hostile_report() -> tuple[Page, str]:
    """Report of a study in which every text that a user or a file can bring in holds markup."""
    records = []
    for record in study():
        problem = {**record.inputs.problem, "options": {"robot": f"{MARKED}.json"}, "parameters": {MARKED: 1.0}}
        records.append(
            replace(
                record,
                inputs=replace(record.inputs, problem=problem),
                settings={"kind": MARKED, MARKED: 1},
                status=MARKED,
                violated=(MARKED,),
                metrics={MARKED: 1.0},
                versions={MARKED: MARKED, "compiler": MARKED},
                active_constraints=tuple(replace(a, name=MARKED, unit=MARKED) for a in record.active_constraints),
            )
        )
    file = StudyFile(command=f"nlp-gait compare --out '{MARKED}'", date=MARKED)
    document = make_study_document(compare_problems(records), file)
    page = Page()
    page.feed(render_page(document))
    return page, render_markdown(document)


def test_a_report_shows_markup_and_does_not_obey_it() -> None:
    page, markdown = hostile_report()
    assert page.tags.count("script") == 1  # the page's own
    assert "img" not in page.tags
    assert not [name for name, _ in page.attributes if name.startswith("on")]
    assert not [value for _, value in page.attributes if value and "javascript:" in value]
    assert SCRIPT in page.text and QUOTED in page.text
    outside_of_figures = [line for line in markdown.splitlines() if not line.startswith("![")]
    assert not [line for line in outside_of_figures if re.search(r"<script|<img|(?<!\\)\]\(", line)]
    assert r"\[link\](javascript" in markdown


def test_text_in_figures_is_escaped() -> None:
    with use_style():
        figure = make_figure()
        figure.subplots().set_xlabel(f"{SCRIPT} {QUOTED}")
        svg = render_svg(figure)
    root = ElementTree.fromstring(svg)
    assert not [element for element in root.iter() if element.tag.endswith(("script", "img"))]
    page = Page()
    page.feed(inline_svg(svg, "f1", "figure 1"))
    assert "script" not in page.tags and "img" not in page.tags and SCRIPT in page.text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("[red]x[/red] [/]", "[red]x[/red] [/]"),
        ("\x1b]0;title\x07\x1b[2J", r"\x1b]0;title\x07\x1b[2J"),
        ("a\rb\x08", r"a\rb\x08"),
        ("\u202eevil", r"\u202eevil"),
        ("half \ud800", r"half \ud800"),
        ("1\u202f793 and 5\u00a0W", "1\u202f793 and 5\u00a0W"),
        ("gr\u00f6\u00dfer 10\u207b\u2076\n", "gr\u00f6\u00dfer 10\u207b\u2076\n"),
    ],
)
def test_the_terminal_shows_control_characters_and_markup(text: str, shown: str) -> None:
    assert escape_controls(text) == shown
    out = io.StringIO()
    console = PlainConsole(file=out, markup=False, highlight=False, force_terminal=True, width=200)
    console.print(text, soft_wrap=True, end="")
    assert out.getvalue() == shown


def test_tables_errors_and_progress_show_them_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row's name, ``torque_change[LKneePitch, 3]``, would be taken for markup and vanish; ``[/]`` would be an error."""
    out, bar = io.StringIO(), io.StringIO()
    for stream in ("stdout", "stderr"):
        monkeypatch.setattr(command, stream, PlainConsole(file=out, markup=False, highlight=False, width=200))
    command.print_table("[red]title\x1b[31m", ("a[/]", "b\x07"), [("\x1b[2J", "[blue]")])
    with pytest.raises(command.typer.Exit):
        command.fail("no file 'a\x1b[31m\nb'")
    text = out.getvalue()
    assert all(shown in text for shown in (r"[red]title\x1b[31m", "a[/]", r"\x1b[2J", "[blue]"))
    assert "\x1b" not in text and "\x07" not in text and text.endswith("nlp-gait: no file 'a\\x1b[31m b'\n")
    monkeypatch.setattr(command, "stderr", PlainConsole(file=bar, force_terminal=True, width=200))
    with command.show_progress("[/] runs\x1b[2J", 2) as advance:
        advance("torque_change[LKneePitch, 3] [/]\x1b[2J")
    assert "[/] runs" in bar.getvalue() and "\x1b[2J" not in bar.getvalue()
    assert "torque_change[LKneePitch, 3]" in bar.getvalue()
