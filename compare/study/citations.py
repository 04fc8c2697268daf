"""What to cite: the software, the suite, and the papers that problems come from; ``citations.toml`` has the entries."""

import inspect
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib.resources import files
from typing import Any

import nlp_gait
from nlp_gait.errors import unknown
from nlp_gait.formulation.registry import find_maker
from nlp_gait.gaitbench.facts import BY_ID
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import is_user_code

SECTION = re.compile(r"^(Attributes|Args|Raises|Returns|Source):$")


def find_citations(name: str | None = None) -> list[str]:
    """Return BibTeX of the software and of what a problem, paper or instance of the suite comes from; all without a name.

    Raises:
        UnknownNameError: there is no problem, paper or instance of that name.
        UserCodeError: a user-defined problem cannot be loaded.
    """
    text = (files("compare.study") / "citations.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text.replace("VERSION", nlp_gait.__version__))
    papers, sources = table["papers"], [*table["papers"].values(), table["suite"]]
    if name in papers:
        sources = [papers[name]]
    elif name is not None:
        source = _find_source(name, {*PROBLEMS, *papers, *BY_ID})
        sources = [entry for entry in sources if entry["cited_as"] in source]  # text by which a ``Source:`` names it
    return [entry["bibtex"].strip() for entry in (table["software"], *sources)]


def _find_source(name: str, ids: set[str]) -> str:
    if name in BY_ID:
        return f"GaitBench: {BY_ID[name].source}"
    if name not in PROBLEMS and not is_user_code(name, "problem"):
        raise unknown("problem, paper or instance", name, ids)
    return dict(split_sections(find_maker(name).__doc__ or "")).get("Source", "")


def cite_problems(problems: Iterable[Mapping[str, Any]]) -> str:
    """Return BibTeX of the software and the sources of problems as records describe them; user code is not loaded."""
    named = [(problem["name"], problem["options"].get("instance")) for problem in problems]
    names = dict.fromkeys(instance if instance in BY_ID else name for name, instance in named)
    lists = [find_citations(name) for name in names if name in BY_ID or name in PROBLEMS]
    return "\n\n".join(dict.fromkeys(entry for entries in lists or [find_citations()[:1]] for entry in entries))


def split_sections(text: str) -> Iterator[tuple[str, str]]:
    """Yield the sections of a Google docstring with their headings; the first has none."""
    heading, lines = "", list[str]()
    for line in inspect.cleandoc(text).splitlines():
        if title := SECTION.match(line):
            yield heading, "\n".join(lines).strip("\n")
            heading, lines = title[1], []
        else:
            lines.append(line)
    yield heading, "\n".join(lines).strip("\n")
