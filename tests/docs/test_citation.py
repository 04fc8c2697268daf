"""What to cite: the citation file is valid, and of this version."""

import re
import tomllib
from pathlib import Path

import yaml

import nlp_gait as package

ROOT = Path(__file__).parents[2]
CFF = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_the_citation_file_is_valid_and_of_this_version() -> None:
    """By the schema of CFF 1.2.0."""
    assert CFF.keys() >= {"authors", "cff-version", "message", "title"} and CFF["cff-version"] == "1.2.0"
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", CFF["date-released"])
    for reference in CFF["references"]:
        assert reference.keys() >= {"authors", "title", "type"} and reference["type"] in ("article", "report")
        assert all(author.keys() <= {"family-names", "given-names"} for author in reference["authors"])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert CFF["version"] == package.__version__ and CFF["license"] == project["project"]["license"]
