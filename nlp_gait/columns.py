"""Tables of numbers from CSV files of other programs."""

import csv
import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from nlp_gait.errors import InputError, unknown
from nlp_gait.files import is_numeric_text, read_text

DELIMITERS = ",;\t"
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
UNNAMED = ("", "Unnamed: 0")  # names of an index, written by R and pandas
MOST = 2**53  # whole number that floats contain exactly


@dataclass(frozen=True, kw_only=True)
class CsvTable:
    """Table of numbers."""

    owner: str  # the file, for messages
    header: tuple[str, ...]  # names of the columns; empty if the file has none
    rows: tuple[tuple[float, ...], ...]  # of equal length; NaN where a cell is empty
    lines: tuple[int, ...]  # line of each row in the file
    texts: tuple[tuple[str, ...], ...]  # the cells as printed, with decimal points

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
            cell, wanted = f"{self.owner}, line {self.lines[row]}: {name}", f"a whole number >= {at_least} and <= 2^53"
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
    """Read a CSV file of numbers, see ``parse_table``; raises InputError."""
    return parse_table(read_text(path, what), f"{what} {str(path)!r}")


def parse_table(text: str, owner: str) -> CsvTable:
    """Read numbers separated by one of ``DELIMITERS``, with or without a header.

    What other programs add is skipped: a line ``sep=``, an unnamed column that counts the rows, unnamed empty columns at the end,
    and lines that begin with ``#``, of which the last one may be the header. Raises InputError with the line and its cause.
    """
    comments = [line.strip("# ") for line in text.splitlines() if line.startswith("#")]
    lines = ["" if line.startswith("#") else line for line in text.splitlines()]
    first = next((line for line in lines if line.strip()), "")
    delimiter = max(DELIMITERS, key=first.count)
    if declared := re.fullmatch(r'"?sep=(.)"?', first.strip(" \r")):
        lines[lines.index(first)] = ""
        delimiter = declared[1]
    rows = _split_cells(lines, delimiter, owner)
    has_header = bool(rows) and not all(_is_number(cell) for cell in rows[0][1] if cell)
    if rows and comments and not has_header:  # NumPy's savetxt
        names = [name.strip() for name in comments[-1].split(delimiter)]
        if has_header := len(names) == len(rows[0][1]) > 1:
            rows.insert(0, (0, names))
    if len(rows) <= has_header:
        raise InputError(f"{owner} has no rows of numbers")
    rows = _drop_unnamed_columns(rows, has_header)
    header = tuple(rows.pop(0)[1]) if has_header else ()
    if "" in header:
        raise InputError(f"{owner}: column {header.index('') + 1} has no name; name it or remove it")
    if repeated := [name for k, name in enumerate(header) if name in header[:k]]:
        raise InputError(f"{owner}: two columns have the same name {repeated[0]!r}; rename one of them")
    commas = [(number, cell) for number, row in rows for cell in row if "," in cell]
    points = any("." in cell for _, row in rows for cell in row)
    if commas and (points or all(THOUSANDS.fullmatch(cell) for _, cell in commas)):
        number, cell = commas[0]
        raise InputError(
            f"{owner}, line {number}: the comma in {cell[:40]!r} may be a decimal comma or separate thousands; write decimal "
            "points, and no separators of thousands"
        )
    width = len(header) or len(rows[0][1])
    for number, row in rows:
        if len(row) != width:
            hint = "; do its numbers have decimal commas? Separate columns by semicolons" if delimiter == "," else ""
            raise InputError(f"{owner}, line {number}: {len(row)} cells, but {width} columns{hint}")
        for cell in row:
            if cell and not _is_number(cell):
                raise InputError(f"{owner}, line {number}: expected a number, got {cell[:40]!r}")
    texts = tuple(tuple(cell.replace(",", ".") for cell in row) for _, row in rows)
    return CsvTable(
        owner=owner,
        header=header,
        rows=tuple(tuple(float(cell) if cell else math.nan for cell in row) for row in texts),
        lines=tuple(number for number, _ in rows),
        texts=texts,
    )


def _split_cells(lines: Sequence[str], delimiter: str, owner: str) -> list[tuple[int, list[str]]]:
    """Return the number and the cells of each line that is not empty."""
    reader, rows = csv.reader(lines, delimiter=delimiter), list[tuple[int, list[str]]]()
    try:
        for row in reader:
            if any(cells := [cell.strip() for cell in row]):
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise InputError(
            f"{owner}, line {reader.line_num}: {error}; is a quotation mark missing, or is it not a CSV file?"
        ) from error
    return rows


def _drop_unnamed_columns(rows: list[tuple[int, list[str]]], has_header: bool) -> list[tuple[int, list[str]]]:
    """Leave out what spreadsheets and data frames add: empty columns at the end, and a first one that counts the rows."""
    width = max(len(row) for _, row in rows)
    while width > 1 and not any(cell for _, row in rows for cell in row[width - 1 :]):
        width -= 1
    name, *counts = [row[0] for _, row in rows]
    is_index = has_header and name in UNNAMED
    is_index = is_index and counts in ([str(k + begin) for k in range(len(counts))] for begin in (0, 1))
    return [(number, row[is_index:width]) for number, row in rows]


def _is_number(cell: str) -> bool:
    """Return whether a cell is a number with a decimal point or comma; Python alone reads 0.3_1, and digits of other scripts."""
    return cell.isascii() and "_" not in cell and is_numeric_text(cell.replace(",", ".", 1))
