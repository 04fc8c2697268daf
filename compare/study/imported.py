"""Results from elsewhere as records of a study: judged like everything else; what is not known stays unknown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.study.record import RunRecord
from compare.study.study import RECORDS, read_records


def imported_records(folder: Path, records: Sequence[RunRecord]) -> list[RunRecord]:
    """Imported records of a folder that are of the very problems of some records."""
    if not (folder / RECORDS).is_dir():
        return []
    known = {record.problem: record.definition["problem"].get("sha256") for record in records}
    return [
        record
        for record in read_records(folder)
        if "imported" in record.definition
        and record.problem in known
        and record.definition["problem"].get("sha256") == known[record.problem]
    ]
