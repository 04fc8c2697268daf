"""What every paper has to keep: rows that are decided, a page in order, and a record that a quick run confirms."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.paper_runs import Runner
from compare.papers.rules import Ruling
from docs.pages.papers import RECORDS, paper_page
from nlp_gait.errors import OutputError


@pytest.mark.slow
@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_a_quick_run_confirms_the_record(name: str, tmp_path: Path) -> None:
    paper = load_reproduction(name)
    recorded = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))["verdicts"]
    quick = paper.reproduce(Runner(folder=tmp_path, jobs=1), paper.quick)["verdicts"]
    assert quick.keys() == recorded.keys() == paper.book.claims.keys()
    for id, row in quick.items():
        words = {*row.values()} if id in paper.book.on_runs else row
        assert words == ({Ruling.NOT_RUN} if id in paper.book.on_runs else recorded[id]), id
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert (
        report.index("holds in") < report.index("## Claims decided by computation") < report.index("## What is not as")
    )


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_the_page_begins_with_at_most_ten_lines(name: str) -> None:
    record = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    first = record["parts"][0]
    assert first["columns"] == ["claim", "printed", "here", "verdict", "holds in"] and len(first["rows"]) <= 10
    assert first["rows"][0][0] in paper_page(name)


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
