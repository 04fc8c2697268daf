"""Markdown of generated pages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

SPECIAL = re.compile(r"([\\*_\[\]#|~<>{}$])")


def literal(text: str) -> str:
    """Return text for a page, on one line; text in backticks remains code."""
    parts = " ".join(text.replace("``", "`").split()).split("`")
    return "`".join(SPECIAL.sub(r"\\\1", part) if k % 2 == 0 else part for k, part in enumerate(parts))


def code(text: str) -> str:
    """Return text as code within a table."""
    return f"`{text}`".replace("|", r"\|") if text else ""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown cells."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def toctree(documents: Iterable[str], *options: str) -> str:
    """Return a hidden tree of documents."""
    return "\n".join(["```{toctree}", ":hidden:", *options, "", *documents, "```"])


def page(*blocks: str) -> str:
    """Join blocks with an empty line between them; empty ones are omitted."""
    return "\n\n".join(block for block in blocks if block) + "\n"


def write_all(folder: Path, pages: Mapping[str, str]) -> None:
    """Write the pages that have changed, and remove other files of the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in folder.iterdir():
        if path.suffix in (".md", ".rst") and path.name not in pages:
            path.unlink()
