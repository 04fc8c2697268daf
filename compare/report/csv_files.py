"""All runs and all make_judged_cells points as CSV files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.study.record import HEADER, JUDGED, RunRecord, make_judged_cells, make_row
from nlp_gait.files import format_csv, replace_nan, write_text


def write_csv_files(folder: Path, records: Sequence[RunRecord], stems: dict[str, str]) -> list[Path]:
    """Write ``runs.csv``, and ``<problem>-points.csv`` for each problem; unknown values are empty cells.

    Args:
        folder: to write to.
        records: of all problems.
        stems: of the files, by problem.

    Raises:
        OutputError: a file cannot be written.
    """
    files = [folder / "runs.csv"]
    write_text(files[0], format_csv([HEADER, *(_cells(make_row(r)) for r in records)]))
    for problem, stem in stems.items():
        own = [record for record in records if record.problem == problem]
        names = list(dict.fromkeys(name for record in own for name in record.x))
        taken = {*names, *JUDGED}
        indexes = list(dict.fromkeys(name for record in own for name in record.verdict.indexes if name not in taken))
        rows = [
            _cells(
                [
                    r.solver,
                    r.run,
                    *(r.x.get(n) for n in names),
                    *make_judged_cells(r),
                    *(r.verdict.indexes.get(n) for n in indexes),
                ]
            )
            for r in own
            if r.x
        ]
        files.append(folder / f"{stem}-points.csv")
        write_text(files[-1], format_csv([("solver", "run", *names, *JUDGED, *indexes), *rows]))
    return files


def _cells(row: list[object]) -> list[object]:
    return ["" if value is None else value for value in replace_nan(row)]
