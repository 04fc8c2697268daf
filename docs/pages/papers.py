"""A page for each paper, from the reproductions that ``python -m benchmarks.papers PAPER`` records in ``docs/papers``."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from compare.papers import REPRODUCTIONS
from compare.study.citations import find_citations
from docs.pages.markdown import literal, page, table, write_all

RECORDS = Path(__file__).parents[1] / "papers"


def write(folder: Path) -> None:
    """Write the tables of each paper, and what to cite, which ``docs/papers.md`` includes."""
    entries = "\n\n".join(find_citations())
    pages = {f"{name}.md": paper_page(name) for name in REPRODUCTIONS}
    write_all(folder / "papers", {**pages, "citations.md": page(f"```text\n{entries}\n```")})


def paper_page(name: str) -> str:
    """Return the tables of a paper."""
    record = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    words = f"Computed by `{record['session']['command']}`, {_describe_origin(record)}"
    return page(literal(words), *_format_parts(record["parts"]))


def _describe_origin(record: dict[str, Any]) -> str:
    session = record["session"]
    return (
        f"version {session['versions']['nlp-gait']}, on {session['started'][:10]}, {session['machine']['processor']}."
    )


def _format_parts(parts: Iterable[dict[str, Any]]) -> list[str]:
    """Return texts, tables, and sections, which the page folds."""
    blocks: list[str] = []
    for part in parts:
        if "title" in part:
            blocks += [f"<details><summary>{part['title']}</summary>", *_format_parts(part["parts"]), "</details>"]
        elif "columns" in part:
            blocks += [literal(part["caption"])] if part["caption"] else []
            blocks.append(table([*map(literal, part["columns"])], ([*map(literal, row)] for row in part["rows"])))
        else:
            blocks.append(part["text"])
    return blocks
