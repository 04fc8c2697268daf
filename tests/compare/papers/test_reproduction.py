"""The frame of all reproductions: claims, templates, and folders that cannot be written to."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path

import pytest

import docs.pages.papers
from compare.papers import REPRODUCTIONS, load_reproduction
from compare.papers.claims import (
    Check,
    Claim,
    ClaimVerdict,
    Difference,
    compare_changes,
    compare_levels,
    compare_readings,
    decide,
    describe_criterion,
    fill_differences,
    make_claims_table,
    make_differences_table,
    require_change,
    require_feasible,
    require_significance,
)
from compare.papers.reproduction import Reproduction
from nlp_gait.errors import OutputError


def test_the_table_of_claims_leaves_out_empty_columns() -> None:
    cheaper = Claim(
        where="p. 3", text="It is cheaper", found="{powers[0]} W, {powers[1]} W", detail="by {saving:.0f} %"
    )
    claims = [
        decide(True, powers=(2, 1), saving=50).apply(cheaper),
        decide(False, powers=(1, 2), saving=-100).apply(cheaper),
        Claim(where="p. 5", text="It is fast", printed="1 m/s", found="no robot", verdict=ClaimVerdict.UNTESTABLE),
    ]
    table = make_claims_table(claims)
    assert list(table.columns) == ["where", "claim", "printed", "found here", "verdict"]
    assert [row[-1] for row in table.rows] == ["holds by 50 %", "does not hold", "cannot be tested here"]
    assert [row[2] for row in table.rows] == ["", "", "1 m/s"]
    assert [row[3] for row in table.rows] == ["2 W, 1 W", "1 W, 2 W", "no robot"]


def test_the_table_of_differences_has_numbers_of_the_report() -> None:
    difference = Difference(where="(3)", printed="mass 1 kg", ours="mass 2 kg", effect="{more:.1f} W more")
    table = make_differences_table(fill_differences([difference], {"more": 0.25}))
    assert list(table.columns) == ["where", "printed", "ours", "effect"] and table.rows[0][-1] == "0.2 W more"


PAPERS = tuple(
    name for name in REPRODUCTIONS if isinstance(load_reproduction(name), Reproduction)
)  # on the older frame


@pytest.mark.parametrize(
    ("check", "verdict", "detail"),
    [
        (compare_levels(2.0, 2.09), "holds", ""),
        (compare_levels(2.0, -2.0), "does not hold", "(printed 2, here -2)"),
        (compare_levels([2.0, 4.0], [2.0, 4.3]), "does not hold", "(1 of 2 within the tolerance)"),
        (compare_changes(-13.0, -12.5), "holds", ""),
        (compare_changes(-13.0, -0.7), "direction holds, size does not", "(printed -13, here -0.7)"),
        (compare_changes(-13.0, 0.7), "does not hold", "(printed -13, here 0.7)"),
        (compare_changes(0.0, 0.0), "holds", ""),
        (compare_changes(-13.0, 0.0), "does not hold", "(printed -13, here 0)"),
        (require_change(0.5), "holds", ""),
        (require_change([0.5, 0.2]), "does not hold", ""),
        (require_change([[0.5, 0.2], [0.2, 0.5]]), "does not hold", ""),
        (require_change([[0.5, 0.4], [0.2, 0.5]]), "cannot be tested here", "(holds under 1 of 2 readings)"),
        (compare_readings([2.0, 4.0], [[2.0, 3.9], [2.05, 4.0]]), "holds", ""),
        (compare_readings([2.0, 4.0], [[2.0, 4.3], [1.0, 4.9]]), "does not hold", "(1 of 2 under every reading)"),
        (compare_readings(2.0, [[2.2], [1.8]]), "cannot be tested here", "(readings differ)"),
        (require_feasible(decide(True), []), "holds", ""),
        (require_feasible(decide(False), ["knee by 1 rad", "hip by 2 N"]), "not shown", "(knee by 1 rad; hip by 2 N)"),
        (require_significance(compare_changes(-13.0, -13.0), "rank sum", 0.2), "not shown", "(rank sum, p = 0.2)"),
        (
            require_significance(compare_changes(-13.0, 13.0), "rank sum", 0.01),
            "does not hold",
            "(printed -13, here 13)",
        ),
    ],
)
def test_verdicts_compare_sizes_with_the_tolerance(check: Check, verdict: str, detail: str) -> None:
    found = check.apply(Claim(where="p. 3", text="It is cheaper", tolerance="5 %", least="0.3 W"))
    assert (found.verdict, found.detail) == (verdict, detail)


def test_a_tolerance_is_absolute_unless_in_percent() -> None:
    claim = Claim(where="p. 3", text="It is short", criterion="at the end", tolerance="2 mm")
    assert [compare_levels(10.0, ours).apply(claim).verdict for ours in (12.0, 12.1)] == ["holds", "does not hold"]
    assert describe_criterion(claim) == "at the end; within 2 mm"


@pytest.mark.parametrize("paper", PAPERS)
def test_every_claim_has_a_check_with_a_criterion_or_a_reason_why_it_cannot_be_tested(paper: str) -> None:
    reproduction = load_reproduction(paper)
    claims = reproduction.printed.claims
    assert {name for name, claim in claims.items() if not claim.verdict} == set(reproduction.checks)
    for (
        claim
    ) in claims.values():  # decided in its file: it cannot be tested, or an earlier commit of the program has tested it
        if claim.verdict:
            assert claim.found
            assert claim.verdict == ClaimVerdict.UNTESTABLE or "computed by commit" in claim.found
    if paper in PAPERS:
        assert [name for name in reproduction.checks if not describe_criterion(claims[name])] == []


@pytest.mark.parametrize("paper", PAPERS)
def test_every_difference_has_an_effect_as_a_number_or_cannot_run_as_printed(paper: str) -> None:
    for row in load_reproduction(paper).printed.differences:
        assert row.cannot_run or re.search(r"\d|\{", row.effect), row.where


@pytest.mark.parametrize("paper", PAPERS)
def test_the_report_has_both_tables(paper: str) -> None:
    reproduction = load_reproduction(paper)
    text = (resources.files("compare.papers") / paper / f"{paper}_report.md").read_text(encoding="utf-8")
    assert "{claims}" in text and "{differences}" in text
    assert reproduction.printed.claims and reproduction.printed.differences


@pytest.mark.parametrize("paper", PAPERS)
def test_the_documentation_has_the_claims_and_differences_of_a_full_reproduction(paper: str) -> None:
    record = json.loads((Path(docs.pages.papers.RECORDS) / f"{paper}.json").read_text(encoding="utf-8"))
    printed = load_reproduction(paper).printed
    assert record["effort"] == "full" or (record["effort"] == "reduced" and record["settings"])
    assert (
        record.get("settings", {}).get("cases", [1, 2, 3]) == [1, 2, 3]
        if paper == "stairs"
        else record["effort"] == "full"
    )
    assert list(record["claims"]) == list(printed.claims)
    assert [row["where"] for row in record["differences"]] == [row.where for row in printed.differences]


@pytest.mark.parametrize("paper", PAPERS)
def test_percentages_in_the_text_are_computed(paper: str) -> None:
    name = load_reproduction(paper).name
    text = (resources.files("compare.papers") / name / f"{name}_report.md").read_text(encoding="utf-8")
    assert not re.findall(r"\d ?%", re.sub(r"\{[^{}]*\}", "", text))


@pytest.mark.parametrize("paper", REPRODUCTIONS)
def test_a_folder_that_cannot_be_written_to_fails_before_the_work(paper: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    reproduction = load_reproduction(paper)
    with pytest.raises(OutputError):
        reproduction.reproduce(tmp_path / "file", reproduction.quick, print)
