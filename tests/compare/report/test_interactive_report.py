"""The report in a real browser: drawings zoom, gaits move, tables sort, all by keyboard, on two screens."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import nlp_gait
from compare.report import write_report
from compare.report.interactive import animate_gait
from compare.study.record import RunRecord
from compare.study.study import StudyFile
from docs.browser import (
    SCREENS,
    Visit,
    list_accessibility_faults,
    list_wide_parts,
    start_browser,
    visit,
    wait_for_motion,
)
from tests.compare.records import DSP_X, record, study
from tests.extras import need_browser

need_browser()
pytestmark = pytest.mark.slow
CONVERGENCE, FINAL = "#figure-walk-convergence", "#figure-walk-final"
GAITS = "#figure-dsp-gaits"


def open_details(page: Any) -> None:
    """Open all headings."""
    page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")


def gaits() -> list[RunRecord]:
    """Two runs with gaits that can be drawn."""
    stored = {"name": "nao-dsp", "options": {}, "parameters": {}}
    other = DSP_X | {"hip_height_m": 0.30}
    return [
        replace(r, x=x, inputs=replace(r.inputs, problem=stored))
        for solver, x, power in (("pso", DSP_X, 0.5), ("ga", other, 0.6))
        for r in [record(solver, 0, [(1, 0.9), (50, power)], problem="dsp")]
    ]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with start_browser() as started:
        yield started


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, browser: Any, coarse_pages: None) -> Path:
    folder = tmp_path_factory.mktemp("interactive")
    write_report(folder, [*study(), *gaits()], StudyFile())
    return folder / "report.html"


@pytest.fixture
def open_report(browser: Any, report: Path) -> Iterator[Visit]:
    with visit(browser, report) as found:
        yield found


@pytest.mark.parametrize("screen", SCREENS)
def test_the_page_fits_is_silent_and_accessible(browser: Any, report: Path, screen: str) -> None:
    with visit(browser, report, screen) as opened:
        page = opened.page
        page.wait_for_selector(f"{FINAL} svg path")
        assert page.evaluate("document.querySelector('#figure-walk-final').getBoundingClientRect().bottom") < 800
        open_details(page)
        page.wait_for_selector(f"{CONVERGENCE} svg path")
        assert page.evaluate("document.documentElement.scrollWidth") <= SCREENS[screen][0]
        assert list_wide_parts(page) == []
        assert list_accessibility_faults(page) == []
        assert (opened.messages, opened.requests) == ([], [])


def test_a_point_has_a_note(open_report: Visit) -> None:
    """The final value of swarm's first run: 10.05 W, 0.5 % above the best known."""
    notes = open_report.page.locator(f"{FINAL} svg title").all_text_contents()
    assert "swarm, run 0: 0.50 %" in notes and len(notes) == 9 + 3  # feasible runs, and medians


def test_drawings_zoom_and_pan_by_keyboard_and_pointer(open_report: Visit) -> None:
    page = open_report.page
    svg = page.locator(f"{FINAL} svg")
    whole = svg.get_attribute("viewBox")
    svg.focus()
    page.keyboard.press("+")
    zoomed = svg.get_attribute("viewBox")
    page.keyboard.press("ArrowRight")
    panned = svg.get_attribute("viewBox")
    box = svg.bounding_box()
    page.mouse.move(box["x"] + 150, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 180, box["y"] + 60)
    page.mouse.up()
    dragged = svg.get_attribute("viewBox")
    assert len({whole, zoomed, panned, dragged}) == 4 and float(panned.split()[0]) > float(zoomed.split()[0])
    page.keyboard.press("0")
    assert svg.get_attribute("viewBox") == whole


def test_gaits_move_pause_and_turn(open_report: Visit) -> None:
    page = open_report.page
    canvas = page.locator(f"{GAITS} canvas")
    canvas.scroll_into_view_if_needed()
    wait_for_motion(page)
    page.click(f"{GAITS} .play")
    picture = "document.querySelector('canvas').toDataURL()"
    still = page.evaluate(picture)
    page.wait_for_timeout(100)
    assert page.evaluate(picture) == still
    canvas.focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate(picture) != still
    page.locator(f"{GAITS} input[type=range]").fill("500")
    assert page.locator(f"{GAITS} .controls output").inner_text() == "0.20 s"  # of 0.4 s


def test_without_javascript_the_drawings_are_shown(browser: Any, report: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(report.as_uri())
    assert page.locator(f"{FINAL} svg").bounding_box()["height"] > 50
    assert page.locator(f"{GAITS} svg").bounding_box()["height"] > 50
    context.close()


@pytest.mark.commit
@pytest.mark.parametrize("screen", SCREENS)
def test_tables_sort(browser: Any, report: Path, screen: str) -> None:
    with visit(browser, report, screen) as opened:

        def sort_by(head: str) -> list[str]:
            """Click a head of the table of solvers, which a phone does not show; return its column."""
            column: list[str] = opened.page.evaluate(
                """(name) => {
                  const table = [...document.querySelectorAll("section:has(> #figure-walk-final) table")].at(-1);
                  const heads = [...table.tHead.rows[0].cells];
                  const i = heads.findIndex((cell) => cell.textContent === name);
                  heads[i].querySelector("button").click();
                  return [...table.tBodies[0].rows].map((row) => row.cells[i].textContent);
                }""",
                head,
            )
            return column

        up, down = sort_by("median gap"), sort_by("median gap")
        assert up == ["0 %", "5.5 %", "18 %"] and down == up[::-1]
        assert sort_by("solver") == ["colony", "newton", "swarm"]
        assert opened.page.locator("section:has(> #figure-walk-final) table").last.locator("[aria-sort]").count() == 1


def test_a_solution_is_a_page_of_its_own_and_a_frame_in_notebooks(browser: Any, tmp_path: Path) -> None:
    shown = animate_gait(nlp_gait.load("nao-dsp"), DSP_X, "paper")
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><main>{shown._repr_html_()}</main>", encoding="utf-8")
    shown.write(tmp_path / "gait.html")
    with visit(browser, tmp_path / "gait.html") as opened:
        wait_for_motion(opened.page)
        assert (opened.messages, opened.requests) == ([], [])
    with visit(browser, tmp_path / "notebook.html") as opened:
        wait_for_motion(opened.page.frames[1])
