"""Tables of each paper's page, from the reproductions that ``python -m benchmarks.papers PAPER`` records in ``docs/papers``."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from compare.papers import REPRODUCTIONS, load_reproduction
from docs.pages.markdown import literal, page, table, write_all

RECORDS = Path(__file__).parents[1] / "papers"


def write(folder: Path) -> None:
    """Write the tables of each paper and the list of papers, which the pages include."""
    pages = {f"{name}.md": paper_page(name) for name in REPRODUCTIONS}
    write_all(folder / "papers", {**pages, "index.md": list_page()})


def read_record(name: str) -> dict[str, Any]:
    """Return the recorded reproduction of a paper."""
    record: dict[str, Any] = json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
    return record


def count_results(results: Mapping[str, str]) -> str:
    """Return a sentence with the number of claims by result."""
    words = ", ".join(f'{n} "{word}"' for word, n in Counter(results.values()).most_common())
    return f"{len(results)} claims: {words}."


def list_page() -> str:
    """Return the table of papers with their results."""
    rows = [
        [f"[{load_reproduction(name).title}](papers/{name}.md)", literal(count_results(read_record(name)["results"]))]
        for name in REPRODUCTIONS
    ]
    return page(table(["paper", "results"], rows))


def paper_page(name: str) -> str:
    """Return the tables of a paper."""
    record = read_record(name)
    made = record["made"]
    words = f"Computed by `{made['command']}`, version {made['nlp-gait']}, on {made['date'][:10]}, {made['processor']}."
    sentences, counted = "\n\n".join(record["sentences"]), literal(count_results(record["results"]))
    return page(
        load_reproduction(name).citation, sentences, *_format_parts(name, record["parts"]), counted, literal(words)
    )


def _format_parts(name: str, parts: Iterable[dict[str, Any]]) -> list[str]:
    """Return texts, tables, and sections, which the page folds."""
    blocks: list[str] = []
    for part in parts:
        if "title" in part:
            blocks += [
                f"<details><summary>{part['title']}</summary>",
                *_format_parts(name, part["parts"]),
                "</details>",
            ]
        elif "figure" in part:
            file = f"/papers/{name}/{part['figure']}.svg"
            blocks.append(f"```{{image}} {file}\n:alt: {part['caption']}\n```\n\n{literal(part['caption'])}")
        elif "columns" in part:
            blocks += [literal(part["caption"])] if part["caption"] else []
            blocks.append(table([*map(literal, part["columns"])], ([*map(literal, row)] for row in part["rows"])))
        else:
            blocks.append(part["text"])
    return blocks
