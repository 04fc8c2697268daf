"""Measured numbers of pages are those of ``docs/numbers.toml``, with the command that measures them."""

import json
import math
import re
import tomllib
from pathlib import Path

import pytest

from docs.pages.numbers import format_numbers, list_values, parse_table, read_numbers
from nlp_gait.proofs.certificate import load_certificates

DOCS = Path(__file__).parents[2] / "docs"
README = DOCS.parent / "README.md"
PAGES = {path.relative_to(DOCS).as_posix(): path for path in (*DOCS.glob("*.md"), *DOCS.glob("model/*.md"))}
PAGES |= {README.name: README}
TYPED = {name: path for name, path in PAGES.items() if name not in ("changelog.md", "contributing.md")}
UNITS = r"%|[mk]?W|J(?:/m)?|[mu]?s|m/s|mm|m|N|N s|Nm|kg|mW"
MEASURED = re.compile(rf"(?<![\w.^\-])[+-]?\d(?:[\d.,]*\d)?(?: to [\d.]+)? ?(?:{UNITS})(?![\w/^*])")
OMITTED = re.compile(r"```.*?```|\$\$.*?\$\$|`[^`\n]*`|\$[^$\n]*\$|\]\([^)]*\)", re.DOTALL)


def find_measured(text: str, definitions: list[str]) -> list[str]:
    """Return the numbers with units in the prose of a page, without code, formulas and definitions."""
    for definition in definitions:
        text = text.replace(definition, " ")
    return MEASURED.findall(OMITTED.sub(" ", text))


@pytest.mark.parametrize("name", sorted(TYPED))
def test_every_number_of_a_page_is_recorded(name: str) -> None:
    """A number with a unit is in ``numbers.toml``, as a measured value or as a definition of the model."""
    definitions = read_numbers()["definitions"].get(name, [])
    text = TYPED[name].read_text(encoding="utf-8")
    recorded = [f"{value} " for value in list_values().values()]
    for found in find_measured(text, definitions):
        assert any(value.startswith(f"{found} ") for value in recorded), found
    assert "{{" not in text
    assert [definition for definition in definitions if definition not in text] == []


def test_every_number_has_its_origin_and_a_reader() -> None:
    numbers = read_numbers()
    text = "\n".join(path.read_text(encoding="utf-8") for path in PAGES.values())
    shown = list_values() | {name: f"generated/numbers/{name}.md" for name in numbers["table"]}
    for name, entry in (numbers["number"] | numbers["table"]).items():
        assert {"command", "date", "commit"} <= entry.keys(), name
        assert shown[name] in " ".join(text.split()), f"no page shows {name}, {shown[name]}"
    assert all(len(row) == len(t["columns"]) for t in numbers["table"].values() for row in t["rows"])


def test_the_file_is_what_the_module_writes() -> None:
    numbers = read_numbers()
    assert tomllib.loads(format_numbers(numbers)) == numbers
    assert parse_table(["title", "| a | b |", "|---|--:|", "| 1 | 2 m |"]) == (["a", "b"], [["1", "2 m"]])


@pytest.mark.parametrize(("phase", "instance"), [("nao_ssp", "ssp-v5"), ("nao_dsp", "dsp-v5")])
def test_stated_bounds_are_those_of_the_certificates(phase: str, instance: str) -> None:
    """A lower bound is rounded down, so that the statement is proven, too; a best known value is rounded to nearest."""
    numbers, certificate = read_numbers()["number"], load_certificates()[instance].certificate
    assert numbers[f"{phase}_bound"]["value"] == f"{math.floor(certificate.bound * 1e7) / 1e7:.7f}"
    assert numbers[f"{phase}_best"]["value"] == f"{certificate.objective:.7f}"


def test_stated_gaps_are_those_of_the_recorded_runs() -> None:
    """Medians of 31 runs of each search over the proven optimum; 98 of 100 starts of IPOPT end there."""
    numbers = list_values()
    solvers = json.loads((DOCS / "difficulty.json").read_text(encoding="utf-8"))["nao-ssp"]["solvers"]
    for name, digits in (("pso", 2), ("ga", 2), ("aco", 3)):
        assert numbers[f"{name}_gap"] == f"{100 * solvers[name]['median_gap']:.{digits}f} %"
        assert solvers[name]["runs"] == 31
    for page in ("index.md", "README.md"):
        text = " ".join(PAGES[page].read_text(encoding="utf-8").split())
        assert (
            f"{solvers['ipopt']['near']} of {solvers['ipopt']['runs']} starts" in text and "median of 31 runs" in text
        )
