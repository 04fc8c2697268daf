"""The records of a study in its folder: ``<folder>/records/<problem>/<solver>-<run>-<key>.json``, one file for each run.

The key is the hash of the run's inputs: runs with different settings never overwrite each other, and a run with the same inputs
is read instead of repeated. ``study.json`` lists the runs that belong to the study; other files stay and are not read.
"""

from collections.abc import Sequence
from pathlib import Path

from compare.study.record import RunRecord, read_record
from compare.study.settings import list_runs, read_manifest
from compare.study.task import Task
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, make_writable_folder, write_json

RECORDS = "records"


def name_run(run: Task | RunRecord) -> str:
    """Return ``<problem>/<solver>-<run>-<key>``; a colon in a label becomes a full stop."""
    if isinstance(run, Task):
        labels, inputs = (run.problem.title, run.title), run.inputs()
    else:
        labels, inputs = (run.problem, run.solver), run.inputs
    return f"{name_group(*labels)}-{run.run:04d}-{inputs.key}"


def name_group(problem: str, solver: str) -> str:
    """Return ``<problem>/<solver>``, with which the names of all runs of a solver on a problem begin."""
    return f"{problem}/{solver}".replace(":", ".")


def locate_record(folder: Path, run: Task | RunRecord) -> Path:
    """Return the file of a run in the folder of a study."""
    return folder / RECORDS / f"{name_run(run)}.json"


def write_records(records: Sequence[RunRecord], folder: Path) -> list[Path]:
    """Write records to a study's folder, make them part of the study, and return their files; raises as ``list_runs``."""
    paths = [write_record(record, make_writable_folder(folder)) for record in records]
    list_runs(folder, [name_run(record) for record in records])
    return paths


def write_record(record: RunRecord, folder: Path) -> Path:
    """Write a record to a study's folder and return its file; raises OutputError."""
    path = locate_record(folder, record)
    make_writable_folder(path.parent)
    write_json(path, record.to_json())
    return path


def find_record(folder: Path, task: Task) -> RunRecord | None:
    """Return the record of a task, None if it has not run; raises InputError for a damaged one."""
    path = locate_record(folder, task)
    return _read_checked(path) if path.exists() else None


def read_records(folder: Path) -> list[RunRecord]:
    """Return the records of a study in the order of ``read_each``; raises InputError if there are none, or one is damaged."""
    records = []
    for _, record in read_each(folder):
        if isinstance(record, InputError):
            raise record
        records.append(record)
    return records


def read_each(folder: Path) -> list[tuple[Path, RunRecord | InputError]]:
    """Return files and records, damaged ones as their error; InputError if there are none.

    Those that ``study.json`` lists are read, in its order; all by their names, if it lists none.
    """
    listed = {folder / RECORDS / f"{name}.json": place for place, name in enumerate(read_manifest(folder).runs)}
    with convert_errors(f"folder {str(folder)!r} cannot be read", InputError):
        paths = [path for path in sorted((folder / RECORDS).glob("*/*.json")) if path in listed or not listed]
        paths.sort(key=lambda path: listed.get(path, 0))
    if not paths:
        raise InputError(f"{str(folder)!r} contains no records ({RECORDS}/<problem>/<solver>-<run>-<key>.json)")
    records: list[tuple[Path, RunRecord | InputError]] = []
    for path in paths:
        try:
            records.append((path, _read_checked(path)))
        except InputError as error:
            records.append((path, error))
    return records


def _read_checked(path: Path) -> RunRecord:
    """Return the record; one under another name than that of its inputs is refused, because it could count twice."""
    record = read_record(path)
    name = name_run(record)
    if path != path.parents[1] / f"{name}.json":
        raise InputError(f"record {str(path)!r} belongs to {name}.json; rename or delete it")
    return record
