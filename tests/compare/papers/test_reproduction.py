"""The frame of all reproductions: claims, templates, and folders that cannot be written to."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

import pytest

from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.claims import Claim, Difference, Verdict, decide, make_claims_table, make_differences_table
from nlp_gait.errors import OutputError


def test_the_table_of_claims_leaves_out_empty_columns() -> None:
    cheaper = Claim(
        where="p. 3", text="It is cheaper", found="{powers[0]} W, {powers[1]} W", detail="by {saving:.0f} %"
    )
    claims = [
        decide(True, powers=(2, 1), saving=50).apply(cheaper),
        decide(False, powers=(1, 2), saving=-100).apply(cheaper),
        Claim(where="p. 5", text="It is fast", printed="1 m/s", found="no robot", verdict=Verdict.UNTESTABLE),
    ]
    table = make_claims_table(claims)
    assert list(table.columns) == ["where", "claim", "printed", "found here", "verdict"]
    assert [row[-1] for row in table.rows] == ["holds by 50 %", "does not hold", "cannot be tested here"]
    assert [row[2] for row in table.rows] == ["", "", "1 m/s"]
    assert [row[3] for row in table.rows] == ["2 W, 1 W", "1 W, 2 W", "no robot"]


def test_the_table_of_differences_has_numbers_of_the_report() -> None:
    difference = Difference(where="(3)", printed="mass 1 kg", ours="mass 2 kg", effect="{more:.1f} W more")
    table = make_differences_table([difference], {"more": 0.25})
    assert list(table.columns) == ["where", "printed", "ours", "effect"] and table.rows[0][-1] == "0.2 W more"


@pytest.mark.parametrize("paper", REPRODUCTIONS)
def test_every_claim_has_either_a_check_or_a_verdict(paper: str) -> None:
    reproduction = load_reproduction(paper)
    checked = {name for name, claim in reproduction.printed.claims.items() if not claim.verdict}
    assert checked == set(reproduction.checks)
    assert all(Verdict(claim.verdict) for claim in reproduction.printed.claims.values() if claim.verdict)


@pytest.mark.parametrize("paper", REPRODUCTIONS)
def test_percentages_in_the_text_are_computed(paper: str) -> None:
    name = load_reproduction(paper).name
    text = (resources.files("compare.papers") / name / f"{name}_report.md").read_text(encoding="utf-8")
    assert not re.findall(r"\d ?%", re.sub(r"\{[^{}]*\}", "", text))


@pytest.mark.parametrize("paper", [name for name in REPRODUCTIONS if name != "nao-claims"])
def test_a_folder_that_cannot_be_written_to_fails_before_the_work(paper: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    reproduction = load_reproduction(paper)
    with pytest.raises(OutputError):
        reproduction.reproduce(tmp_path / "file", reproduction.quick, print)
