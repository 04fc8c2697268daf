"""What a question answers, handed out in one way: a report for people, tables and an object for programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from compare.report.document import Document, Table, Value, text_table
from compare.report.writing import write_document
from nlp_gait.files import replace_nan, write_json

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer(Document):
    """A report that is printed too, with the data that other programs read. Named tables become CSV files and are not printed.

    Attributes:
        stem: name of the page's and the data's files, without suffix.
        data: the whole answer as plain data.
        results: gaits or certificates that other commands read, by the names of their files, without suffix.
    """

    stem: str
    data: Mapping[str, Any]
    results: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def write(self, folder: Path) -> list[Path]:
        """Write the report with its tables and figures, the results and the data; returns the paths.

        Raises:
            OutputError: a file cannot be written.
        """
        written = write_document(folder, self, self.stem)
        for name, data in {**self.results, self.stem: self.data}.items():
            written.append(folder / f"{name}.json")
            write_json(written[-1], replace_nan(data))
        return written


def table_of(caption: str, items: Iterable[T], columns: Mapping[str, Callable[[T], str]]) -> Table:
    """Table for people with a row for each item: under each heading, what its column says of the item."""
    return text_table(tuple(columns), [[cell(item) for cell in columns.values()] for item in items], caption)


def all_digits(name: str, header: Sequence[str], rows: Sequence[Sequence[Value]]) -> Table:
    """Table that is a CSV file with every digit, and rounded on the page."""
    return Table(name=name, columns=dict.fromkeys(header, ".6g"), rows=rows, caption=f"As in {name}.csv, rounded")


def optima_table(optima: Mapping[str, Mapping[str, float]]) -> Table:
    """Optima side by side, one row for each variable.

    Args:
        optima: x by variable name, under the heading of its column.
    """
    rows = [(name, *(f"{x[name]:.5g}" for x in optima.values())) for name in next(iter(optima.values()))]
    return text_table(("variable", *optima), rows, "Optima")
