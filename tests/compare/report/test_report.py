"""A report from records made by hand: every number in it is known."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from compare.analysis.columns import summarise
from compare.analysis.comparison import compare_problems
from compare.analysis.headline import write_headline
from compare.report import FurtherFiles, write_report
from compare.report.provenance import make_solver_table
from compare.report.study_report import make_study_document, renew_report
from compare.study.study import StudyFile, name_record, write_record
from nlp_gait.errors import InputError
from nlp_gait.formulation import Objective
from tests.compare.records import DSP_X, judged, record, study

FILE = StudyFile(command="nlp-gait compare <b>walk</b>", date="2026-01-01 00:00:00 UTC")


class Tables(HTMLParser):
    """Texts of all tables of a page, and whatever it would load."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.loads: list[str] = []
        self._cell: list[str] | None = None
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self._cell = []
        for name, value in attrs:
            if name in ("src", "href", "xlink:href") and value and not value.startswith(("#", "data:")):
                self.loads.append(value)

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th") and self._cell is not None:
            self.rows[-1].append("".join(self._cell).replace("\u202f", ""))
            self._cell = None

    def handle_data(self, data: str) -> None:
        if self._cell is not None:
            self._cell.append(data)

    def row(self, first: str, second: str | None = None) -> list[str]:
        """The first row that begins so."""
        return next(r for r in self.rows if r[0] == first and (second is None or r[1] == second))

    def below(self, *header: str) -> list[list[str]]:
        """Rows under a header that begins so, up to the next one of equal cells."""
        start = next(i for i, r in enumerate(self.rows) if r[: len(header)] == list(header))
        return self.rows[start + 1 :]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    write_report(out, [replace(r, versions={"processor": "abacus", "nlp-gait": "1.0"}) for r in study()], FILE)
    return out


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def tables(page: str) -> Tables:
    return Tables(page)


def test_summaries_by_hand() -> None:
    (comparison,) = compare_problems(study())
    assert comparison.reference == 10.0
    newton, swarm, colony = summarise(comparison)
    assert [row["solver"] for row in (newton, swarm, colony)] == ["newton", "swarm", "colony"]
    # n = 2: 5 + 5 + 4 * 3 + 4 * 3 + 3 * 6 = 52; two successes and one failure: 3 * 52 / 2.
    assert (
        newton["median_evaluations"] == 52.0 and newton["evaluations_to_1"] == newton["evaluations_to_0_0001"] == 78.0
    )
    assert newton["seconds_to_0_01"] == pytest.approx(0.75)
    assert (newton["runs"], newton["reported_feasible"], newton["feasible"], newton["best_reported"]) == (3, 3, 2, 9.5)
    # To 1 %: after 300 and 400, two failures of 500: 1700 / 2. Nothing comes within 0.1 %.
    assert (swarm["evaluations_to_1"], swarm["evaluations_to_0_1"]) == (850.0, math.inf)
    assert (swarm["best"], swarm["median"], swarm["worst"]) == (10.05, 10.55, 12.0)
    assert (swarm["median_gap"], swarm["best_gap"]) == pytest.approx((0.055, 0.005))
    # To 1 % after 100, to 0.1 % after 200; three failures of 500. The median of all runs is between 10.5 and 13.
    assert (colony["evaluations_to_1"], colony["evaluations_to_0_1"]) == (1600.0, 1700.0)
    assert colony["median_gap"] == pytest.approx(0.175)
    assert [colony[key] for key in ("feasible", "reported_feasible", "best")] == [3, 3, 10.005]
    assert [colony[key] for key in ("median", "worst")] == [10.5, 13.0]


def test_tables_of_solvers_running_times_pairs_prices_and_failures(tables: Tables) -> None:
    """Columns in which nothing is known, such as guarantees here, are left out."""
    assert tables.below("solver", "runs")[:2] == [
        ["newton", "3", "2/3", "0 %", "0 %", "2/3", "52", "0.5"],
        ["swarm", "4", "4/4", "5.5 %", "0.50 %", "2/4", "500", "5"],
    ]
    judged_row = "newton|3|3/3|2/3|3/3|9.500000 W|10.000000 W|10.000000 W|10.000000 W"
    assert "|".join(tables.below("solver", "runs", "reported feasible")[0]) == judged_row

    rows = tables.below("solver", "evaluations to 1 %")
    assert rows[0] == ["newton", "78", "78", "78", "78", "0.75", "0.75", "0.75", "0.75"]
    assert rows[1] == ["swarm", "850", "-", "-", "-", "8.5", "-", "-", "-"]
    assert rows[2] == ["colony", "1600", "1700", "-", "-", "16", "17", "-", "-"]

    pairs = {row[0]: row[1:] for row in tables.below("better median < other")[:3]}
    # Costs: newton 10, 10, inf; swarm 10.05, 10.1, 11, 12; colony 10.005, 10.5, inf, 13.
    # The first is better in 8 of 12 pairs; in 8 of 12 with one tie; in 10 of 16.
    assert pairs["newton < swarm"][-1] == f"{8 / 12:.3f}"
    assert pairs["newton < colony"][-1] == f"{8.5 / 12:.3f}"
    assert pairs["swarm < colony"][-1] == f"{(3 + 3 + 2 + 2) / 16:.3f}"

    assert tables.row("knee <b>torque</b>")[1:] == ["upper", "2.5 Nm", "-0.125 W per Nm", "-0.0125 W for 0.1 Nm"]

    rows = tables.below("solver", "run", "seed")[:2]
    assert rows[0] == ["newton", "2", "2", "restoration failed", "balance by 0.1 m"]
    assert rows[1][:4] == ["colony", "2", "2", "<script>alert(1)</script> | failed"]


def test_the_page_begins_with_the_answer_and_folds_the_rest(page: str, folder: Path) -> None:
    text = re.sub(r"<[^>]*>", " ", page.partition("<main>")[2])
    title, meta, task, *rest = (line.strip() for line in text.splitlines() if line.strip())
    assert (title, task) == ("walk: power", "walk") and meta.startswith("2026-01-01, v1.0: ")
    assert " ".join(" ".join(rest).split()).startswith(write_headline(compare_problems(study())[0]))
    assert (
        (folder / "report.md")
        .read_text(encoding="utf-8")
        .startswith("# walk: power\n\n2026-01-01, v1.0: nlp-gait compare")
    )
    folded = re.findall(r"<details><summary><h2>(.*?)</h2>", page)
    assert len(folded) == 5 and "All problems" not in page
    assert page.index("<table") < page.index("<details>")


def test_statistics_over_problems_appear_from_five_problems_on() -> None:
    for count in (4, 5):
        records = [replace(r, problem=f"walk-{k}") for k in range(count) for r in study()]
        document = make_study_document(compare_problems(records), StudyFile())
        assert ("All problems" in [section.title for section in document.sections]) == (count == 5)


def test_the_page_shows_command_and_machine_and_loads_nothing(page: str, tables: Tables) -> None:
    assert tables.loads == []
    assert tables.row("command") == ["command", "nlp-gait compare <b>walk</b>"]
    assert tables.row("processor") == ["processor", "abacus"]
    assert "@import" not in page and "url(http" not in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_a_damaged_record_is_named_and_left_out(tmp_path: Path, coarse_pictures: None) -> None:
    write_record(judged("pso", DSP_X), tmp_path)
    write_record(judged("pso", DSP_X, run=1), tmp_path).write_text("{")
    records, damaged, _ = renew_report(tmp_path, FurtherFiles(csv=True))
    assert [record.run for record in records] == [0] and "is not valid JSON" in damaged[0]
    assert (tmp_path / "runs.csv").read_text().count("pso") == 1


MARGIN = Objective(name="margin", unit="m", sense="maximise")


def test_records_that_disagree_on_the_objective_are_refused(tmp_path: Path) -> None:
    other = record("pso", 1, [(10, 1.0)], objective=MARGIN)
    with pytest.raises(InputError, match="disagree on the objective"):
        compare_problems([record("pso", 0, [(10, 1.0)]), other])


def test_maximised_objectives_are_ranked_the_other_way() -> None:
    runs = [record("pso", run, [(10, value)], objective=MARGIN) for run, value in enumerate((0.1, 0.2, 0.4))]
    (summary,) = summarise(compare_problems(runs)[0])
    assert (summary["best"], summary["median"], summary["worst"]) == (0.4, 0.2, 0.1)
    assert summary["median_gap"] == pytest.approx(0.5)


def test_a_statistic_and_a_figure_are_added_as_documented() -> None:
    """The code of the page adds a column of known values, and a figure with a line for each solver."""
    blocks = re.findall(
        r"```python\n(.*?)```",
        (Path(__file__).parents[3] / "docs" / "add-a-statistic.md").read_text(encoding="utf-8"),
        re.DOTALL,
    )
    assert all(len(block.splitlines()) <= 20 for block in blocks)
    names = {"comparison": compare_problems(study())[0]}
    exec("\n".join(blocks), names)
    assert names["header"][-1] == "spread [%]"
    assert [row[-1] for row in names["rows"]] == ["0.00", "19.40", "29.94"]
    assert {"newton", "swarm", "colony"} <= {text.get_text() for text in names["figure"].axes[0].texts}


def test_a_running_study_says_how_many_runs_have_ended(tmp_path: Path) -> None:
    """Three of four planned runs have ended; runs that another command planned do not count."""
    records = [record("a", run, [(100, value)]) for run, value in enumerate((0.9, 0.8, 0.7))]
    planned = [*map(name_record, records), "walk/c-0000-00000000"]
    write_report(tmp_path, records, replace(FILE, runs=(*planned, "walk/a-0003-00000000")))
    assert "3 of 4 runs have ended" in (tmp_path / "report.html").read_text()
    write_report(tmp_path, records, replace(FILE, runs=tuple(planned)))
    assert "runs have ended" not in (tmp_path / "report.html").read_text()


def test_runs_with_equal_settings_are_one_row() -> None:
    runs = [record("pso", k, [(10, 1.0)]) for k in range(3)]
    changed = replace(runs[2], inputs=replace(runs[2].inputs, settings={"population": 30}))
    table = make_solver_table([*(replace(run, settings={"population": 50}) for run in runs[:2]), changed])
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    assert [(row["given settings"], row["all settings"]) for row in rows] == [
        ("-", "population: 50"),
        ("population: 30", "kind: pso"),
    ]
    assert [(row["seeds"], row["runs"]) for row in rows] == [("0 to 1", "2"), ("2 to 2", "1")]
