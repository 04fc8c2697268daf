"""The frame of all reproductions: claims, templates, and folders that cannot be written to."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

import pytest

from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.reproduction import Claim, Verdict, check_claim, make_claims_table
from nlp_gait.errors import OutputError


def test_the_table_of_claims_leaves_out_empty_columns() -> None:
    claims = [
        check_claim(True, where="p. 3", text="Slower is cheaper", found="2 W, 1 W", detail="by 50 %"),
        check_claim(False, where="p. 4", text="Higher is cheaper", found="1 W, 2 W", detail="by -100 %"),
        Claim(where="p. 5", text="It is fast", printed="1 m/s", found="no robot", verdict=Verdict.UNTESTABLE),
    ]
    table = make_claims_table(claims)
    assert list(table.columns) == ["where", "claim", "printed", "found here", "verdict"]
    assert [row[-1] for row in table.rows] == ["holds by 50 %", "does not hold", "cannot be tested here"]
    assert [row[2] for row in table.rows] == ["", "", "1 m/s"]


@pytest.mark.parametrize("paper", REPRODUCTIONS)
def test_percentages_in_the_text_are_computed(paper: str) -> None:
    text = (resources.files("compare.papers") / load_reproduction(paper).template).read_text(encoding="utf-8")
    assert not re.findall(r"\d ?%", re.sub(r"\{[^{}]*\}", "", text))


@pytest.mark.parametrize("paper", [name for name in REPRODUCTIONS if name != "nao-claims"])
def test_a_folder_that_cannot_be_written_to_fails_before_the_work(paper: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    reproduction = load_reproduction(paper)
    with pytest.raises(OutputError):
        reproduction.reproduce(tmp_path / "file", reproduction.quick, print)
