"""What a question answers, handed out in one way: a report for people, tables and an object for programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from compare.report.document import Document, Table, Value, text_table
from compare.report.writing import write_document
from nlp_gait.files import without_nan, write_json


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """An answer, ready to be printed and written.

    Attributes:
        stem: name of the report and of the data, without ending.
        document: the answer for people. Its tables with a name are for other programs, the others are printed too.
        data: the whole answer as plain data.
        results: gaits for the other commands, by the names of their files, without ending.
    """

    stem: str
    document: Document
    data: Mapping[str, Any]
    results: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def write(self, folder: Path) -> list[Path]:
        """Write the report with its tables and figures, the results and the data; returns the paths.

        Raises:
            OutputError: a file cannot be written.
        """
        written = write_document(folder, self.document, self.stem)
        for name, data in {**self.results, self.stem: self.data}.items():
            written.append(folder / f"{name}.json")
            write_json(written[-1], without_nan(data))
        return written


def all_digits(name: str, header: Sequence[str], rows: Sequence[Sequence[Value]]) -> Table:
    """Table that is a CSV file with every digit, and rounded on the page."""
    return Table(name=name, columns=dict.fromkeys(header, ".6g"), rows=rows, caption=f"As in {name}.csv, rounded")


def optima_table(optima: Mapping[str, Mapping[str, float]]) -> Table:
    """Optima side by side, one row for each variable.

    Args:
        optima: x by variable name, under the heading of its column.
    """
    names = next(iter(optima.values()))
    return text_table(
        ("variable", *optima), [(name, *(f"{x[name]:.5g}" for x in optima.values())) for name in names], "Optima"
    )
