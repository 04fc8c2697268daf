"""Rules that decide about claims, and tables that bind them to functions."""

from pathlib import Path
from typing import Any

import pytest

from compare.papers import load_reproduction
from compare.papers.paper import Paper, parse_settings
from compare.papers.paper_runs import Effort
from compare.papers.rules import Alternatives, ClaimRow, Found, Judgement, Ruling, decide, describe, judge


def make_claim(rule: str, printed: str = "", unit: str = "") -> ClaimRow:
    return ClaimRow(id="one", where="1", claim="it is so", printed=printed, unit=unit, rule=rule, note="")


@pytest.mark.parametrize(
    ("rule", "printed", "unit", "found", "verdict"),
    [
        ("within 5 %", "1.0 / 2.0", "W", [1.05, 1.9], "holds"),
        ("within 5 %", "1.0", "W", 1.051, "does not hold"),
        ("within 0.2 mm", "30.7", "mm", 30.9, "holds"),
        ("within 25 %", "+5.0", "mm", 9.0, "size differs"),
        ("within 25 %", "+5.0", "mm", -5.0, "does not hold"),
        ("falls", "", "W", [3.0, 2.0, 1.0], "holds"),
        ("falls", "", "W", [3.0, 1.0, 2.0], "does not hold"),
        ("rises 1 mm", "", "mm", [[1.0, 2.5], [1.0, 1.5]], "does not hold"),
        ("rises 10 %", "", "m", [1.0, 1.1], "holds"),
        ("p < 0.05", "", "mW", Found(2.0, p=0.01), "holds"),
        ("p < 0.05", "", "mW", Found(-2.0, p=0.01), "does not hold"),
        ("p < 0.05", "", "mW", Found(2.0, p=0.06), "not shown"),
        ("at least 50 %", "", "%", [50.0, 70.0], "holds"),
        ("at most 5 mm", "", "mm", [4.0, 6.0], "does not hold"),
        ("same order", "1.283 / 1.303", "W", [0.867, 0.892], "holds"),
        ("rank", "1.283", "W", [1.2, 1.3, 1.25], "holds"),
        ("rank", "1.299", "W", [1.2, 1.3, 1.25], "not shown"),  # within the runs, but beyond 90 % of them
        ("rank", "1.35", "W", [1.2, 1.3, 1.25], "not shown"),
        ("rank", "1.283", "W", [0.86, 0.87], "does not hold"),
        ("rank", "1.2 / 3.0", "W", [[1.0, 1.3], [2.9, 3.1]], "holds"),
        ("rank", "1.2 / 3.2", "W", [[1.0, 1.3], [2.9, 3.1]], "not shown"),
        ("rank", "1.2 / 4.0", "W", [[1.0, 1.3], [2.9, 3.1]], "does not hold"),
        ("ahead", "", "%", [[1.0, 3.0], [2.0, 2.0]], "holds"),
        ("ahead", "", "%", [[1.0, -3.0], [2.0, 2.0]], "not shown"),
        ("ahead", "", "%", [[-1.0, -3.0], [2.0, 2.0]], "does not hold"),
        ("same order", "0.128 / 0.125 / 0.05", "m/s", [0.125, 0.13, 0.055], "does not hold"),
        ("p < 0.05", "", "mW", Found(2.0, p=[0.001, 0.06, 0.3]), "not shown"),
        ("at least 1 W", "", "W", None, "not shown"),
        ("at least 1 W", "", "W", float("nan"), "not shown"),
    ],
)
def test_a_rule_decides(rule: str, printed: str, unit: str, found: Any, verdict: str) -> None:
    claim = make_claim(rule, printed, unit)
    assert decide(claim, found if found is None or isinstance(found, Found) else Found(found)) == verdict


@pytest.mark.parametrize("rule", ["near 5 %", "within", "at least 5 kg", "p <"])
def test_a_rule_that_cannot_decide_is_refused(rule: str) -> None:
    with pytest.raises(ValueError, match="one"):
        make_claim(rule, printed="1.0", unit="W")


def test_a_cell_shows_numbers_with_their_unit() -> None:
    assert describe(make_claim("within 5 %", "+1 / +2", "mm"), Found([1.0, 2.25])) == "+1.000 / +2.250 mm"
    assert describe(make_claim("rank", "2", "W"), Found([1.0, 3.0])) == "1 to 3 W; 1 of 2 runs below"
    assert (
        describe(make_claim("rank", "2 / 4", ""), Found([[1.0, 3.0], [5.0, 6.0]]))
        == "1 to 3; 5 to 6; 1 / 0 of 2 runs below"
    )
    claim = make_claim("p < 0.05", "", "mW")
    assert describe(claim, Found(0.5, p=0.012)) == "0.5 mW, p = 0.012"
    assert describe(claim, Found(0.5, p=[0.2, 0.001, 0.01])) == "0.5 mW, p = 0.01 (0.001 to 0.2 in 3 tests)"


def test_a_result_that_a_choice_changes_depends_on_it() -> None:
    claim = make_claim("within 10 %", "1.0", "m")
    assert judge(claim, Alternatives("the time", {"1 s": 1.0, "2 s": 1.05})).verdict == "holds"
    one = judge(claim, Alternatives("the time", {"1 s": 1.0, "2 s": 0.5}))
    assert one.verdict == "depends" and one.here == "on the time: 1 s: holds (1 m); 2 s: does not hold (0.5 m)"


def test_excluded_readings_decide_nothing_and_others_only_if_they_vary_a_choice() -> None:
    paper = load_reproduction("walk12")
    holds, fails = Judgement(Ruling.HOLDS, "1"), Judgement(Ruling.FAILS, "2")
    literal, free, varied = paper.readings.keys() - paper.choices.keys(), "(A1)", "ankle raised"
    assert free in literal and varied in paper.choices
    row = {"as printed": holds, free: fails}
    assert paper.combine(row, {}) == holds
    assert paper.combine(row, {"as printed": "misses"}) == fails
    assert paper.combine({**row, varied: fails}, {}).here.startswith("on the ankle's height: as printed: holds (1)")


@pytest.mark.parametrize("numbers", [{}, {"one": float, "two": float}])
def test_an_id_on_one_side_only_is_refused(numbers: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "made_up.csv").write_text("id,where,claim,printed,unit,rule,note\none,1,it is so,,,falls,\n")
    known: dict[str, Any] = {"module": str(tmp_path / "made_up.py"), "title": "", "full": Effort(), "quick": Effort()}
    known |= {"readings": {}, "compute": lambda runner, effort: {}, "headlines": ()}
    Paper(**known, numbers={"one": float})
    with pytest.raises(ValueError, match="one row and one function each: (one|two)"):
        Paper(**known, numbers=numbers)
    with pytest.raises(ValueError, match="one row and one function each: one"):
        Paper(**known, numbers={"one": float}, numbers_of_runs={"one": float})


def test_an_option_of_a_difference_is_read_as_on_the_command_line() -> None:
    assert parse_settings("base=hip limit=false masses=23 --set kp.upper=100.0") == (
        {"base": "hip", "limit": False, "masses": 23},
        {"kp.upper": 100.0},
    )
    assert parse_settings("GeneticAlgorithm in Python") == ({}, {})
