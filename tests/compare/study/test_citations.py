"""What to cite: one source of truth, and every problem leads to its papers."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

import nlp_gait as package
from compare.study.citations import cite_problems, find_citations
from nlp_gait.gaitbench.facts import DEFINITIONS
from nlp_gait.providers import PROBLEMS
from tests.compare.cli.calls import as_json, nlp_gait, one_sentence

ROOT = Path(__file__).parents[3]
CFF = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
# Of the schema of CFF 1.2.0: required keys, and types of references that are used here.
REQUIRED = {"authors", "cff-version", "message", "title"}
TYPES = {"article", "report"}
KEY = re.compile(r"^@\w+\{(.*),$", re.MULTILINE)


def keys(entries: list[str]) -> list[str]:
    return KEY.findall("\n".join(entries))


def read(entry: str) -> dict[str, str]:
    """Fields of an entry by name, without braces around titles and organisations."""
    fields = re.findall(r"^  (\w+) = \{(.*)\},?$", entry, re.MULTILINE)
    return {name: value.removeprefix("{").removesuffix("}") for name, value in fields}


def convert(reference: dict[str, Any]) -> dict[str, str]:
    """The fields of a reference of the citation file under BibTeX's names."""
    found = {k: str(v) for k, v in reference.items() if k not in ("type", "notes", "institution", "authors")}
    names = [a.get("name") or f"{a['family-names']}, {a['given-names']}" for a in reference["authors"]]
    found["author"] = " and ".join(names)
    if "notes" in reference:
        found["note"] = reference["notes"]
    if "institution" in reference:
        found["institution"] = reference["institution"]["name"]
    return found


def test_the_citation_file_is_valid_and_equal_to_the_packages_data() -> None:
    assert CFF.keys() >= REQUIRED and CFF["cff-version"] == "1.2.0" and CFF["type"] in ("software", "dataset")
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", CFF["date-released"])
    for reference in CFF["references"]:
        assert reference.keys() >= {"authors", "title", "type"} and reference["type"] in TYPES
        assert all(author.keys() <= {"family-names", "given-names"} for author in reference["authors"])
        assert isinstance(reference.get("number", ""), str) and isinstance(reference.get("year", 0), int)
    software, *papers, _ = map(read, find_citations())
    assert papers == [convert(reference) for reference in CFF["references"]]
    released = {"year": CFF["date-released"][:4], "note": f"Version {CFF['version']}"}
    assert software == {"author": CFF["authors"][0]["name"], "title": CFF["title"], **released}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert CFF["version"] == package.__version__ and CFF["license"] == project["project"]["license"]
    assert "study/citations.toml" in project["tool"]["setuptools"]["package-data"]["compare"]


@pytest.mark.parametrize("name", [*PROBLEMS, *(definition.id for definition in DEFINITIONS)])
def test_every_problem_and_instance_leads_to_its_source(name: str) -> None:
    papers = {"nao": "Gupta2023", "humanoid": "Gupta2023", "walk12": "Goswami2008", "stairs": "Bhardwaj"}
    instance = next((d for d in DEFINITIONS if d.id == name), None)
    family = (instance.problem if instance else name).partition("-")[0]
    expected = {"nlp-gait", *([papers[family]] if family in papers else []), *(["gaitbench"] if instance else [])}
    assert set(keys(find_citations(name))) == expected | ({"gaitbench"} if name == "gaitbench" else set())


def test_the_command_prints_bibtex() -> None:
    whole = nlp_gait("list", "--cite").stdout
    assert keys([whole]) == ["nlp-gait", "Gupta2023", "Goswami2008", "Bhardwaj", "gaitbench"]
    assert whole.count("{") == whole.count("}") and f"note = {{Version {CFF['version']}}}" in whole
    assert "author = {Gupta, Pushpendra and Pratihar, Dilip Kumar and Deb, Kalyanmoy}" in whole
    assert keys(as_json("list", "--cite", "nao")["entries"]) == ["nlp-gait", "Gupta2023"]
    assert "unknown problem, paper or instance 'walk13'; did you mean 'walk12'" in one_sentence(
        "list", "--cite", "walk13"
    )
    assert "known: " in one_sentence("list", "--cite", "0")


def test_reports_cite_the_instance_and_leave_user_code_alone() -> None:
    problems = [{"name": "gaitbench", "options": {"instance": "ssp-v5"}}, {"name": "absent.py:mine", "options": {}}]
    assert keys([cite_problems(problems)]) == ["nlp-gait", "Gupta2023", "gaitbench"]
