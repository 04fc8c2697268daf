"""What to cite: one source of truth, and every problem leads to its papers."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml

from compare.study.citations import OWN, cite_problems, find_citations
from nlp_gait.gaitbench.definitions import DEFINITIONS
from nlp_gait.providers import PROBLEMS
from tests.compare.cli.calls import as_json, nlp_gait, one_sentence

ROOT = Path(__file__).parents[3]
CFF = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
DATA = tomllib.loads((ROOT / "compare/study/citations.toml").read_text(encoding="utf-8"))
# Of the schema of CFF 1.2.0: required keys, and types of references that are used here.
REQUIRED = {"authors", "cff-version", "message", "title"}
TYPES = {"article", "report"}


def test_the_citation_file_is_valid_and_equal_to_the_packages_data() -> None:
    assert CFF.keys() >= REQUIRED and CFF["cff-version"] == "1.2.0" and CFF["type"] in ("software", "dataset")
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", CFF["date-released"])
    for reference in CFF["references"]:
        assert reference.keys() >= {"authors", "title", "type"} and reference["type"] in TYPES
        assert all(author.keys() <= {"family-names", "given-names"} for author in reference["authors"])
        assert isinstance(reference.get("number", ""), str) and isinstance(reference.get("year", 0), int)
    own = [{k: v for k, v in paper.items() if k not in OWN} for paper in DATA["papers"].values()]
    assert CFF["references"] == own
    software = {k: v for k, v in DATA["software"].items() if k not in OWN}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {k: CFF[k] for k in software} == software
    assert CFF["version"] == project["version"] and CFF["license"] == project["license"]
    assert "study/citations.toml" in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*PROBLEMS, *(definition.id for definition in DEFINITIONS)])
def test_every_problem_and_instance_leads_to_its_source(name: str) -> None:
    keys = [citation.key for citation in find_citations(name)]
    papers = {"nao": "Gupta2023", "humanoid": "Gupta2023", "walk12": "Goswami2008", "stairs": "Bhardwaj"}
    instance = next((d for d in DEFINITIONS if d.id == name), None)
    family = (instance.problem if instance else name).partition("-")[0]
    expected = {"nlp-gait", *([papers[family]] if family in papers else []), *(["gaitbench"] if instance else [])}
    assert set(keys) == expected | ({"gaitbench"} if name == "gaitbench" else set())


def test_the_command_prints_bibtex() -> None:
    whole = nlp_gait("cite").stdout
    assert re.findall(r"^@\w+\{(.*),$", whole, re.MULTILINE) == [
        *("nlp-gait", "Gupta2023", "Goswami2008", "Bhardwaj", "gaitbench")
    ]
    assert whole.count("{") == whole.count("}") and f"note = {{Version {CFF['version']}}}" in whole
    assert "author = {Gupta, Pushpendra and Pratihar, Dilip Kumar and Deb, Kalyanmoy}" in whole
    assert [entry["key"] for entry in as_json("cite", "nao-pareto")["entries"]] == ["nlp-gait", "Gupta2023"]
    assert "unknown problem, paper or instance 'walk13'; did you mean 'walk12'" in one_sentence("cite", "walk13")
    assert "known: " in one_sentence("cite", "0")


def test_reports_cite_the_instance_and_leave_user_code_alone() -> None:
    problems = [{"name": "gaitbench", "options": {"instance": "ssp-v5"}}, {"name": "absent.py:mine", "options": {}}]
    assert re.findall(r"@\w+\{(.*),", cite_problems(problems)) == ["nlp-gait", "Gupta2023", "gaitbench"]
