"""Tables of numbers from CSV files of other programs."""

import csv
import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from nlp_gait.errors import InputError, unknown
from nlp_gait.files import is_numeric_text, read_text

DELIMITERS = ",;\t"
EXACT = 2.0**53  # the floats from here on are not all whole numbers
MOST = 2**63 - 1  # a whole number in 64 bits, as other programs read it


@dataclass(frozen=True, kw_only=True)
class CsvTable:
    """Table of numbers."""

    owner: str  # the file, for messages
    header: tuple[str, ...]  # names of the columns; empty if the file has none
    rows: tuple[tuple[float, ...], ...]  # of equal length; NaN where a cell is empty
    lines: tuple[int, ...]  # line of each row in the file

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows[0])

    def column(self, name: str) -> tuple[float, ...] | None:
        """Return the values of a column; None if there is no such column."""
        return tuple(row[self.header.index(name)] for row in self.rows) if name in self.header else None

    def check_header(self, needed: Collection[str], allowed: Collection[str]) -> None:
        """Check that all needed columns exist, else InputError, and no others than the allowed ones, else UnknownNameError."""
        missing = [name for name in needed if name not in self.header]
        if missing:
            header = ", ".join(self.header) or "no header"
            raise InputError(f"{self.owner} needs the columns {', '.join(missing)}; it has {header}")
        for name in self.header:
            if name not in needed and name not in allowed:
                raise unknown(f"column of {self.owner}", name, [*needed, *allowed])

    def count(self, name: str, row: int, value: float, at_least: int = 0) -> int:
        """Return the value of a cell as a whole number; raises InputError."""
        if not (math.isfinite(value) and value == int(value) and at_least <= value <= MOST):
            cell, wanted = f"{self.owner}, line {self.lines[row]}: {name}", f"a whole number >= {at_least} and < 2^63"
            raise InputError(f"{cell} must be {wanted}, got {value:g}; fix the cell")
        return int(value)

    def number(self, name: str, row: int, value: float, at_least: float = -math.inf) -> float:
        """Return the value of a cell, a finite number or NaN where it is empty; raises InputError."""
        if not (math.isnan(value) or (math.isfinite(value) and value >= at_least)):
            allowed = "a finite number" if math.isinf(at_least) else f"a finite number >= {at_least:g}"
            cell = f"{self.owner}, line {self.lines[row]}: {name}"
            raise InputError(f"{cell} must be {allowed}, got {value:g}; leave the cell empty if it is unknown")
        return value


def read_table(path: Path, what: str) -> CsvTable:
    """Read a CSV file of numbers, separated by one of ``DELIMITERS``, with or without a header; raises InputError."""
    text = read_text(path, what)
    owner = f"{what} {str(path)!r}"
    first = text.partition("\n")[0]
    delimiter = max(DELIMITERS, key=first.count)
    lines = enumerate(csv.reader(text.splitlines(), delimiter=delimiter), start=1)
    filled = [(number, [cell.strip() for cell in row]) for number, row in lines if any(cell.strip() for cell in row)]
    header: tuple[str, ...] = ()
    if filled and not all(is_numeric_text(cell) for cell in filled[0][1] if cell):
        header = tuple(filled.pop(0)[1])
        if len(set(header)) < len(header):
            raise InputError(f"{owner}: two columns have the same name")
    if not filled:
        raise InputError(f"{owner} has no rows of numbers")
    width = len(header) or len(filled[0][1])
    rows = []
    for number, row in filled:
        if len(row) != width:
            raise InputError(f"{owner}, line {number}: {len(row)} cells, but {width} columns")
        for cell in row:
            if cell and not is_numeric_text(cell):
                raise InputError(f"{owner}, line {number}: expected a number, got {cell[:40]!r}")
        rows.append(tuple(_parse_number(cell) if cell else math.nan for cell in row))
    return CsvTable(owner=owner, header=header, rows=tuple(rows), lines=tuple(number for number, _ in filled))


def _parse_number(cell: str) -> float:
    """Return a number; a whole one that a float would round stays whole, as seeds do."""
    value = float(cell)
    return int(cell) if abs(value) >= EXACT and cell.isdecimal() else value
