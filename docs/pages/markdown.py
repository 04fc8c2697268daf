"""Markdown of generated pages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

SPECIAL = re.compile(r"([\\*_\[\]#|~<>{}$])")


def literal(text: str) -> str:
    """Text as a page shows it, on one line; what stands in backticks stays code."""
    parts = " ".join(text.replace("``", "`").split()).split("`")
    return "`".join(SPECIAL.sub(r"\\\1", part) if k % 2 == 0 else part for k, part in enumerate(parts))


def code(text: str) -> str:
    """Text as code within a table."""
    return f"`{text}`".replace("|", r"\|") if text else ""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are Markdown already."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def toctree(documents: Iterable[str], *options: str) -> str:
    """A hidden tree of documents."""
    return "\n".join(["```{toctree}", ":hidden:", *options, "", *documents, "```"])


def page(*blocks: str) -> str:
    """Blocks with an empty line between them; empty ones are left out."""
    return "\n\n".join(block for block in blocks if block) + "\n"


def write_all(folder: Path, pages: Mapping[str, str]) -> None:
    """Write pages by their names, those that have changed alone, and remove other files of the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in folder.iterdir():
        if path.suffix in (".md", ".rst") and path.name not in pages:
            path.unlink()
