"""The pages of formulas: each equation is numbered once and can be rendered, and what refers to a number finds it."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "model").glob("*.md"))
EQUATION = re.compile(r"```\{math\}\n:label: ([A-Z]\.[0-9]+)\n\n(.*?)\n```", re.DOTALL)
FORMULAS = {label: tex for path in PAGES for label, tex in EQUATION.findall(path.read_text(encoding="utf-8"))}


def test_there_are_many_and_none_is_numbered_twice() -> None:
    found = [label for path in PAGES for label, _ in EQUATION.findall(path.read_text(encoding="utf-8"))]
    assert len(found) == len(set(found)) >= 80 and len(PAGES) >= 9
    letters = {
        path.name: {label[0] for label, _ in EQUATION.findall(path.read_text(encoding="utf-8"))} for path in PAGES
    }
    assert all(len(own) <= 1 for own in letters.values())  # a page has one letter
    for letter in {label[0] for label in found}:
        numbers = [int(label[2:]) for label in found if label[0] == letter]
        assert numbers == list(range(1, len(numbers) + 1))  # in the order of the page


def test_references_lead_to_equations() -> None:
    """On the pages by their role, in docstrings by their number."""
    referred = {label for path in PAGES for label in re.findall(r"\{eq\}`([^`]*)`", path.read_text(encoding="utf-8"))}
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "nlp_gait").rglob("*.py"))
    in_code = set(re.findall(r"\(([BCDKLPRSTWM]\.[0-9]+)\)", code))
    assert referred and len(in_code) >= 20
    assert referred | in_code <= FORMULAS.keys()
