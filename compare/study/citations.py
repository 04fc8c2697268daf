"""What to cite: the software, the suite, and the papers that problems come from; ``citations.toml`` has the data."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

from compare.study.description import split_sections
from nlp_gait.errors import unknown
from nlp_gait.formulation.registry import find_maker
from nlp_gait.gaitbench.definitions import BY_ID
from nlp_gait.providers import PROBLEMS
from nlp_gait.user_code import is_user_code

OWN = ("key", "cited_as", "also")
"""Fields of an entry that the Citation File Format does not have."""
SPECIAL = re.compile(r"([&%$#_])")


@dataclass(frozen=True, kw_only=True)
class Citation:
    """An entry: its fields as in the Citation File Format."""

    key: str  #: of BibTeX
    fields: Mapping[str, Any]
    cited_as: str = ""  #: text by which a ``Source:`` names it
    also: tuple[str, ...] = ()  #: further names

    @property
    def bibtex(self) -> str:
        """The entry for BibTeX: an article, a report or a misc."""
        data = self.fields
        year = data.get("year", data.get("date-released", "")[:4] or None)
        found = {
            "author": " and ".join(map(_format_author, data["authors"])),
            "title": f"{{{_escape(data['title'])}}}",
            "journal": data.get("journal"),
            "institution": data.get("institution", {}).get("name"),
            "number": data.get("number"),
            "year": year,
            "doi": data.get("doi"),
            "note": f"Version {data['version']}" if "version" in data else data.get("notes"),
        }
        kind = "article" if "journal" in data else "techreport" if "institution" in data else "misc"
        lines = [f"  {name} = {{{value}}}" for name, value in found.items() if value]
        return "\n".join([f"@{kind}{{{self.key},", ",\n".join(lines), "}"])


def find_citations(name: str | None = None) -> list[Citation]:
    """Return the software and what a problem, paper or instance of the suite comes from; everything without a name.

    Raises:
        UnknownNameError: there is no problem, paper or instance of that name.
        UserCodeError: a user-defined problem cannot be loaded.
    """
    software, suite, papers = _read()
    if name is None:
        return [software, *papers.values(), suite]
    own = [paper for known, paper in papers.items() if name == known or name in paper.also]
    if own:
        return [software, *own]
    if name in BY_ID:
        source = f"{suite.cited_as}: {BY_ID[name].source}"
    elif name in PROBLEMS or is_user_code(name, "problem"):
        source = dict(split_sections(find_maker(name).__doc__ or "")).get("Source", "")
    else:
        raise unknown(
            "problem, paper or instance",
            name,
            {*PROBLEMS, *papers, *(n for p in papers.values() for n in p.also), *BY_ID},
        )
    return [software, *(found for found in (*papers.values(), suite) if found.cited_as in source)]


def cite_problems(problems: Iterable[Mapping[str, Any]]) -> str:
    """Return BibTeX of the software and the sources of problems as records describe them; user code is not loaded."""
    named = [(problem["name"], problem["options"].get("instance")) for problem in problems]
    names = dict.fromkeys(instance if instance in BY_ID else name for name, instance in named)
    found = {one.key: one.bibtex for one in find_citations()[:1]}
    for name in names:
        if name in BY_ID or name in PROBLEMS:
            found |= {one.key: one.bibtex for one in find_citations(name)}
    return "\n\n".join(found.values())


@cache
def _read() -> tuple[Citation, Citation, dict[str, Citation]]:
    """Return the software, the suite, and the papers by name."""
    raw = tomllib.loads((files("compare.study") / "citations.toml").read_text(encoding="utf-8"))
    raw["software"]["version"] = version("nlp-gait")
    return _make(raw["software"]), _make(raw["suite"]), {name: _make(entry) for name, entry in raw["papers"].items()}


def _make(entry: Mapping[str, Any]) -> Citation:
    fields = {name: value for name, value in entry.items() if name not in OWN}
    also = tuple(entry.get("also", ()))
    return Citation(key=entry["key"], fields=fields, cited_as=entry.get("cited_as", ""), also=also)


def _format_author(author: Mapping[str, str]) -> str:
    if "name" in author:
        return f"{{{_escape(author['name'])}}}"
    return ", ".join(_escape(author[part]) for part in ("family-names", "given-names") if part in author)


def _escape(text: str) -> str:
    return SPECIAL.sub(r"\\\1", text)
