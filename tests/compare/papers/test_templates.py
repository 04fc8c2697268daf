"""Texts of the reproductions: every number is a place for a computed one, names something, or is the paper's."""

from __future__ import annotations

import re
from importlib import resources

import pytest

# What has digits but is no result: a reference, a symbol with an index, a power of a unit, a word of the paper.
NO_RESULT = (
    r"\{[^{}]*\}",  # a place for a value
    r"`[^`]*`",
    r"^\|[ |d.,\defgs:-]*\|$",  # formats of a table's columns
    r"joints?(?: angles)?,? \d+(?:, \d+)+",  # joints by their numbers
    r"\]\([\w.-]+\)",  # the file of a figure
    r"\((?:A?\d+|\d+[a-z])\)(?:[-–]\(A?\d+\))?",  # an equation
    r"\b(?:Tables?|Figs?\.|[Ss]ections?|rows|eqs?\.|Equations|Windows) [\d.]+(?:(?:, | to | and )\d+)*",
    r"\b[A-Za-zθ_]+\d+(?:max|z|y|')?(?![\w.])'?",  # f1, x_r, f1max, P0z
    r"(?:m|s|rad|mm|W|N|kg|[a-z)]+)\^\d",
    r"\b\d+-(?:joint|[Ll]ink|DOF)\b",
    r"\((?:19|20)\d\d\)",
    r"95 %",
)
# Numbers that the papers print, or that are mathematics, by reproduction; whoever adds one says which.
ALLOWED: dict[str, dict[str, str]] = {
    "stairs": {
        "2": "t2 = 2 t1, 2 / pi, 2 u^2: formulas of the paper",
        "0.01": "dt of the paper's (43)",
        "30": "toe angle as printed, degrees",
        "1e-4": "rate of Table II",
    },
    "walk12": {
        "0.15": "lambda of Table IV and Fig. 8",
        "1": "lambda, the range of Table III",
        "0.1": "lambda of Fig. 16",
        "0.9": "lambda of the circle",
        "8": "K of section 5.4, degrees",
        "15": "epochs, a quotation",
        "0.125": "speed as printed",
        "7": "sections 7, 7.1 and 7.2",
        "7.1": "likewise",
        "7.2": "likewise",
        "0": "0..T, formula of the paper",
        "2": "s / 2, kinematics",
    },
    "nao_pareto": {
        "25": "degrees of freedom, in the paper's title",
        "12": "variables, the abstract",
        "13": "likewise",
        "100": "population of the searches",
        "1": "what the ranges of the front count as",
    },
    "nao": {
        "0.015": "swing height of the paper",
        "50": "population of the paper",
        "11": "samples of the paper",
        "1e-5": "what counts as the same optimum",
        "1000": "the judge's dense grid",
        "0.5": "what the paper did for rows 6 to 11",
    },
    "nao_walk": {},
}


def numbers_left(text: str) -> list[str]:
    for pattern in NO_RESULT:
        text = re.sub(pattern, " ", text, flags=re.MULTILINE)
    return re.findall(r"\d+(?:\.\d+)?(?:e-?\d+)?", text)


@pytest.mark.parametrize("paper", ALLOWED)
def test_no_result_stands_in_the_text(paper: str) -> None:
    text = (resources.files(f"compare.papers.{paper}") / f"{paper}_report.md").read_text(encoding="utf-8")
    found = set(numbers_left(text))
    assert found - set(ALLOWED[paper]) == set(), "computed numbers have a place in braces; the paper's are listed here"
    assert set(ALLOWED[paper]) - found == set(), "no longer in the text"


def test_the_scan_finds_what_it_is_for() -> None:
    old = "closer than 0.117 m; 27.5 mm; 0.065 m/s at s = 0.13 m; 1 to 7 cm in (7) and Table III, grows 3 to 6 times"
    assert numbers_left(old) == ["0.117", "27.5", "0.065", "0.13", "1", "7", "3", "6"]


@pytest.mark.parametrize(
    "verdict", ["no feasible plan", "All solvers end", "threefold", "sixfold", "cannot be told from"]
)
def test_verdicts_that_nobody_computed_are_gone(verdict: str) -> None:
    for paper in ALLOWED:
        text = (resources.files(f"compare.papers.{paper}") / f"{paper}_report.md").read_text(encoding="utf-8")
        assert verdict not in " ".join(text.split())
