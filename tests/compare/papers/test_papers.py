"""What every paper has to keep: rows that are decided, a page in order, and a record that a quick run confirms."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.paper_runs import Runner
from compare.papers.rules import Ruling
from compare.papers.walk12.results import RAISED, READINGS, SECOND, TABLE_3
from compare.study.record import read_record
from docs.pages.papers import RECORDS, paper_page
from nlp_gait.errors import OutputError

Quick = Callable[[str], tuple[Path, dict[str, Any]]]
# IPOPT starts from the printed solutions alone, which decide the verdicts.
FEWER = {"nao": {"starts": 0}}
FIGURES = {"nao": 9, "walk12": 5, "stairs": 8}  # without those of runs


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory, coarse_pages: None) -> Quick:
    """Return folder and record of a paper's quick reproduction, which is run once."""

    @cache
    def reproduce(name: str) -> tuple[Path, dict[str, Any]]:
        folder, paper = tmp_path_factory.mktemp(name), load_reproduction(name)
        return folder, paper.reproduce(Runner(folder=folder, jobs=1), replace(paper.quick, **FEWER.get(name, {})))

    return reproduce


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_a_quick_run_confirms_the_record(name: str, quick: Quick) -> None:
    paper = load_reproduction(name)
    recorded = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))["verdicts"]
    folder, fresh = quick(name)
    assert fresh["verdicts"].keys() == recorded.keys() == paper.claims.keys()
    for id, row in fresh["verdicts"].items():
        words = {*row.values()} if id in paper.numbers_of_runs else row
        assert words == ({Ruling.NOT_RUN} if id in paper.numbers_of_runs else recorded[id]), id
    report = (folder / "report.md").read_text(encoding="utf-8")
    order = (
        paper.title,
        paper.citation,
        *fresh["sentences"],
        "gait.svg",
        "Claims decided by",
        "What is not as printed",
    )
    places = [report.index(words) for words in order]
    assert places == sorted(places)
    assert len(list(folder.glob("figure*.svg"))) >= FIGURES[name]


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_the_page_begins_with_at_most_ten_lines(name: str) -> None:
    record = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    picture, first = record["parts"][:2]
    assert (
        picture["figure"] == "gait"
        and first["columns"] == ["claim", "printed", "here", "result"]
        and len(first["rows"]) <= 10
    )
    assert first["rows"][0][0] in paper_page(name)
    assert 0 < len(record["sentences"]) <= 3 and {*record["results"]} == {*record["verdicts"]}


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_every_recorded_claim_is_decided(name: str) -> None:
    record = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    assert {*Ruling} >= {word for row in record["verdicts"].values() for word in row.values()}
    assert not any(word == Ruling.NOT_RUN for row in record["verdicts"].values() for word in row.values())


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_a_folder_that_cannot_be_written_to_fails_before_the_work(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    paper = load_reproduction(name)
    with pytest.raises(OutputError):
        paper.reproduce(Runner(folder=tmp_path / "file"), paper.quick)


def test_claims_of_the_12_joint_walk_hold_in_some_readings_only() -> None:
    verdicts = json.loads((RECORDS / "walk12.json").read_text(encoding="utf-8"))["verdicts"]
    assert verdicts["f1-last"] == {name: "holds" if name == RAISED else "does not hold" for name in READINGS}
    assert verdicts["f1-over-time"] == {name: "holds" if name == SECOND else "does not hold" for name in READINGS}
    assert set(verdicts["speed"].values()) == {"depends"} and set(verdicts["accuracy"].values()) == {"does not hold"}


@pytest.mark.nightly  # with the quick run above
def test_tables_of_the_12_joint_walk_agree_with_the_records(quick: Quick) -> None:
    folder, record = quick("walk12")
    records = folder / "records"
    starts = [read_record(path) for path in (records / "as-printed-1").glob("ipopt-*.json")]
    assert len(starts) == load_reproduction("walk12").quick.starts
    (tables,) = [part["parts"] for part in record["parts"] if part.get("title", "") == "Tables III and IV"]
    shown = dict(zip(tables[0]["columns"], tables[0]["rows"][-1], strict=True))
    assert float(shown["optimum"]) == pytest.approx(max(run.objective for run in starts), rel=5e-4)
    assert float(shown["print"]) == TABLE_3[-1].f
