"""Measured numbers of the documentation: ``docs/numbers.toml``.

Pages state these numbers, and a test compares them; each table is a file that a page includes. A benchmark prints its table as
Markdown, and this module replaces the recorded one by it:

    python -m docs.pages.numbers    # prints all numbers and the commands that measure them
    python -m benchmarks.engine speeds | python -m docs.pages.numbers engine-speeds
"""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import Any

from docs.pages.markdown import page, table, write_all

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "numbers.toml"
HEADER = (
    FILE.name
    + ": measured numbers of the documentation, read by docs/pages/numbers.py; each names the command that measures it."
)


def read_numbers() -> dict[str, Any]:
    """Return the numbers and tables by name, and for each page the numbers with units that are definitions."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def list_values() -> dict[str, str]:
    """Return the text of each number, with its unit."""
    return {name: f"{entry['value']} {entry['unit']}".strip() for name, entry in read_numbers()["number"].items()}


def write(folder: Path) -> None:
    """Write a file for each table."""
    tables = read_numbers()["table"]
    write_all(folder / "numbers", {f"{name}.md": page(table(t["columns"], t["rows"])) for name, t in tables.items()})


def parse_table(lines: Iterable[str]) -> tuple[list[str], list[list[str]]]:
    """Return the columns and the rows of the first table of a text in Markdown."""
    cells = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if line.startswith("|")]
    return cells[0], cells[2:]


def format_numbers(numbers: dict[str, Any]) -> str:
    """Return the file's text."""
    definitions = [f"{json.dumps(name)} = {_format_list(texts)}" for name, texts in numbers["definitions"].items()]
    blocks = [f"# {HEADER}", "\n".join(["[definitions]", *definitions])]
    for kind in ("number", "table"):
        for name, entry in numbers[kind].items():
            lines = [f"{key} = {_format_value(value)}" for key, value in entry.items()]
            blocks.append("\n".join([f"[{kind}.{name}]", *lines]))
    return "\n\n".join(blocks) + "\n"


def _format_value(value: Any) -> str:
    nested = isinstance(value, list) and value and isinstance(value[0], list)
    return _format_list(value) if nested else json.dumps(value, ensure_ascii=False)


def _format_list(values: list[Any]) -> str:
    return "\n".join(["[", *(f"    {json.dumps(value, ensure_ascii=False)}," for value in values), "]"])


def main() -> None:
    """Print all numbers, or replace a table by the one on standard input."""
    numbers = read_numbers()
    if len(sys.argv) == 1:
        for name, value in list_values().items():
            entry = numbers["number"][name]
            print(f"{value}: {entry['what']} ({entry['command']}, {entry['date']})")
        return
    name = sys.argv[1]
    columns, rows = parse_table(sys.stdin)
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    numbers["table"][name] |= {
        "date": date.today().isoformat(),
        "commit": commit.stdout.strip(),
        "columns": columns,
        "rows": rows,
    }
    FILE.write_text(format_numbers(numbers), encoding="utf-8")


if __name__ == "__main__":
    main()
