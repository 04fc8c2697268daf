"""Measured numbers stand in ``docs/numbers.toml`` alone, with the command that measures them; pages include them."""

import math
import re
import tomllib
from pathlib import Path

import pytest

from docs.pages.numbers import format_numbers, list_substitutions, parse_table, read_numbers
from nlp_gait.proofs.certificate import load_certificates

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {path.relative_to(DOCS).as_posix(): path for path in (*DOCS.glob("*.md"), *DOCS.glob("model/*.md"))}
TYPED = {name: path for name, path in PAGES.items() if name not in ("changelog.md", "contributing.md")}
UNITS = r"%|[mk]?W|J(?:/m)?|[mu]?s|m/s|mm|m|N|N s|Nm|kg|mW"
MEASURED = re.compile(rf"(?<![\w.^\-])[+-]?\d(?:[\d.,]*\d)?(?: to [\d.]+)? ?(?:{UNITS})(?![\w/^*])")
OMITTED = re.compile(r"```.*?```|\$\$.*?\$\$|\{\{.*?\}\}|`[^`\n]*`|\$[^$\n]*\$|\]\([^)]*\)", re.DOTALL)


def find_measured(text: str, definitions: list[str]) -> list[str]:
    """Return the numbers with units in the prose of a page, without code, formulas and definitions."""
    for definition in definitions:
        text = text.replace(definition, " ")
    return MEASURED.findall(OMITTED.sub(" ", text))


@pytest.mark.parametrize("name", sorted(TYPED))
def test_no_measured_number_is_typed_into_a_page(name: str) -> None:
    """A number with a unit is a definition of the model (listed in ``numbers.toml``) or comes from there."""
    definitions = read_numbers()["definitions"].get(name, [])
    text = TYPED[name].read_text(encoding="utf-8")
    assert find_measured(text, definitions) == []
    assert [definition for definition in definitions if definition not in text] == []


def test_measured_numbers_are_recognised() -> None:
    text = "needs 0.85 W, `1 mm`, {{ price }}, 2 of 3 starts, 12 % more and 5 ms, on a sole of 80 mm"
    assert find_measured(text, ["a sole of 80 mm"]) == ["0.85 W", "12 %", "5 ms"]


def test_every_number_has_its_origin_and_a_reader() -> None:
    numbers = read_numbers()
    text = "\n".join(path.read_text(encoding="utf-8") for path in PAGES.values())
    for kind, form in (("number", "{{{{ {} }}}}"), ("table", "generated/numbers/{}.md")):
        for name, entry in numbers[kind].items():
            assert {"command", "date", "commit"} <= entry.keys(), name
            assert form.format(name) in text, f"no page shows {name}"
    assert set(re.findall(r"\{\{ (\w+) \}\}", text)) == set(list_substitutions())
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
