"""The records of a study in its folder: ``<folder>/records/<problem>/<solver>-<run>.json``, one file for each run.

A record that belongs to another definition keeps its content under ``<solver>-<run>.<key>.json``.
"""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from compare.study.definition import hash_definition, is_same_definition
from compare.study.record import RunRecord, read_record
from compare.study.task import Task
from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import convert_errors, lock_folder, make_writable_folder, rename, write_json

RECORDS = "records"
KEY_DIGITS = 8


def locate_run(folder: Path, problem: str, solver: str, run: int) -> Path:
    """Return ``<folder>/<problem>/<solver>-<run>.json``; a colon in a label becomes a full stop."""
    problem, solver = (title.replace(":", ".") for title in (problem, solver))
    return folder / problem / f"{solver}-{run:04d}.json"


def locate_record(folder: Path, task: Task) -> Path:
    """Return the file to which a task's record is written in the folder of a study."""
    return locate_run(folder / RECORDS, task.problem.title, task.title, task.run)


def write_record(record: RunRecord, folder: Path) -> Path:
    """Write a record to a study's folder and return its file; one of another definition is renamed. Raises OutputError."""
    path = _locate(folder / RECORDS, record)
    if not path.parent.is_dir():
        make_writable_folder(path.parent)
    with convert_errors(f"cannot write to {str(path.parent)!r}", OutputError), lock_folder(path.parent):
        if path.exists():
            with suppress(InputError):  # a damaged record is overwritten
                earlier = read_record(path).definition
                if not is_same_definition(earlier, record.definition):
                    rename(path, _add_key(path, earlier))
        write_json(path, record.to_json())
        # Another study in this folder may have renamed a record of the same definition.
        _add_key(path, record.definition).unlink(missing_ok=True)
    return path


def read_records(folder: Path) -> list[RunRecord]:
    """Return all records in a folder by file name, those of other definitions last; InputError for none or a damaged one."""
    records = []
    for _, record in read_each(folder):
        if isinstance(record, InputError):
            raise record
        records.append(record)
    return records


def read_each(folder: Path) -> list[tuple[Path, RunRecord | InputError]]:
    """Return files and records in the order of ``read_records``, damaged ones as their error; InputError if there are none."""
    with convert_errors(f"folder {str(folder)!r} cannot be read", InputError):
        found: list[tuple[Path, RunRecord | InputError]] = []
        for place in sorted({path.parent for path in (folder / RECORDS).glob("*/*.json")}):
            with lock_folder(place):  # another study may rename them
                found += [(path, _read_or_error(path)) for path in sorted(place.glob("*.json"))]
    if not found:
        raise InputError(f"{str(folder)!r} contains no records ({RECORDS}/<problem>/<solver>-<run>.json)")
    found.sort(key=lambda item: isinstance(item[1], RunRecord) and item[0] != _locate(folder / RECORDS, item[1]))
    return found


def _read_or_error(path: Path) -> RunRecord | InputError:
    try:
        return _read_checked(path)
    except InputError as error:
        return error


def _locate(folder: Path, record: RunRecord) -> Path:
    return locate_run(folder, record.problem, record.solver, record.run)


def find_record(folder: Path, task: Task) -> tuple[RunRecord | None, RunRecord | None]:
    """Return a task's record, or None and the record of another definition in its place; raises InputError for damaged ones."""
    path = locate_record(folder, task)
    if not path.parent.is_dir():
        return None, None
    definition, other = task.definition(), None
    with lock_folder(path.parent):  # another study may rename them
        if not path.exists():
            return None, None
        for candidate in (path, _add_key(path, definition)):
            if candidate.exists():
                record = _read_checked(candidate)
                if is_same_definition(record.definition, definition):
                    return record, None
                other = other or record
    return None, other


def _add_key(path: Path, definition: Mapping[str, Any]) -> Path:
    return path.with_name(f"{path.stem}.{hash_definition(definition)[:KEY_DIGITS]}.json")


def _read_checked(path: Path) -> RunRecord:
    """Return the record; a copy under another name is refused, because it would count twice."""
    record = read_record(path)
    own = _locate(path.parents[1], record)
    if path not in (own, _add_key(own, record.definition)):
        raise InputError(f"record {str(path)!r} belongs to {own.parent.name}/{own.name}; rename or delete it")
    if path != own and own.exists() and is_same_definition(read_record(own).definition, record.definition):
        raise InputError(f"record {str(path)!r} is also {own.parent.name}/{own.name}; delete one of them")
    return record
