"""Claims of the papers and our differences, a page for each paper, from the recorded reproductions in ``docs/papers``.

``python -m benchmarks.papers PAPER`` computes ``docs/papers/PAPER.json``, the ``summary.json`` of the reproduction. It names its
effort, ``full``, ``quick`` or ``reduced``, and the settings that differ from the full one, which ``--effort FILE`` reads.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from compare.papers.claims import Claim, Difference, make_claims_table, make_differences_table
from compare.papers.reproduction import count_verdicts
from compare.report.document import Table
from compare.report.provenance import format_settings
from compare.study.citations import find_citations
from docs.pages.markdown import literal, page, table, write_all

RECORDS = Path(__file__).parents[1] / "papers"
PAPERS = ("nao", "walk12", "stairs")


def write(folder: Path) -> None:
    """Write the tables of each paper, and what to cite, which ``docs/papers.md`` includes."""
    entries = "\n\n".join(find_citations())
    pages = {f"{name}.md": paper_page(name) for name in PAPERS}
    write_all(folder / "papers", {**pages, "citations.md": page(f"```text\n{entries}\n```")})


def paper_page(name: str) -> str:
    """Return the tables of a paper."""
    path = RECORDS / f"{name}.json"
    if not path.exists():
        return page(f"No full reproduction is recorded yet: `nlp-gait reproduce {name} --out DIR` computes the tables.")
    record = json.loads(path.read_text(encoding="utf-8"))
    if "verdicts" in record:
        words = f"Computed by `{record['session']['command']}`, {_describe_origin(record)}"
        return page(literal(words), *_format_parts(record["parts"]))
    claims = {key: Claim(**claim) for key, claim in record["claims"].items()}
    differences = [Difference(**row) for row in record["differences"]]
    return page(
        literal(f"{count_verdicts(claims)} {_describe(record, name)}"),
        "### Claims",
        _format(make_claims_table(claims.values())),
        "### What is not as printed",
        _format(make_differences_table(differences)),
    )


def _describe(record: dict[str, Any], name: str) -> str:
    effort = record["effort"]
    flag = {"full": "", "quick": " --quick", "reduced": " --effort FILE"}[effort]
    settings = ", ".join(f"{key} = {format_settings(value)}" for key, value in record.get("settings", {}).items())
    reduced = f"with a reduced effort: {settings}, by" if effort == "reduced" else "by"
    return f"Computed {reduced} `nlp-gait reproduce {name}{flag}`, {_describe_origin(record)}"


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


def _format(found: Table) -> str:
    def cells(row: Iterable[object]) -> list[str]:
        return [literal(str(cell)) for cell in row]

    return table(cells(found.columns), map(cells, found.rows))
