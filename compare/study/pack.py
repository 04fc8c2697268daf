"""A study as one ZIP file, with the user's files that take part in it; nothing in an archive from elsewhere is trusted.

``files/<hash>/`` has the files of a user's problem, limit, solver or robot, and ``files.json`` the main one of each by its hash.
"""

import json
import os
import shlex
import stat
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.study.record import RunRecord
from compare.study.study import FILE, RECORDS, name_record
from nlp_gait.decoding import decode_value
from nlp_gait.errors import InputError, UserCodeError
from nlp_gait.files import convert_errors, read_bytes, read_json, replace_file
from nlp_gait.formulation.added_limits import split_names
from nlp_gait.robots.loading import hash_robot, list_robot_files
from nlp_gait.robots.packages import find_robot_file
from nlp_gait.user_code import (
    PROGRAM,
    Kind,
    allow_code,
    is_program,
    is_reference,
    read_source_files,
    resolve_code,
    split_command,
)

FILES, INDEX = "files", "files.json"
# Files of a study's folder next to its records; everything else in it stays out of the archive.
PARTS = (FILE, "*.html", "*.md", "*.png", "*.svg", "*.csv", "*.tex", "*.pdf", "better-*.json")
EPOCH = (1980, 1, 1, 0, 0, 0)  # time of all entries, so that equal studies give equal archives
MOST_FILES, MOST_LEVELS, LARGEST_TOTAL = 10_000, 64, 2**30  # of an archive; the last one in bytes
HIGHEST_RATIO = 200  # of the sizes of a file and of its compressed form, beyond the first megabyte
Code = tuple[str, Kind, str]
"""User code of a run: its name, its kind, and the hash of its files."""


def pack_study(folder: Path, records: Sequence[RunRecord], out: Path) -> Path:
    """Write the archive of a study and return it.

    Raises:
        InputError: a file cannot be read, or has changed since the study.
        UserCodeError: user code took part that is not where it was, and that the command does not name.
        OutputError: the archive cannot be written.
    """
    paths = [folder / RECORDS / f"{name_record(record)}.json" for record in records]
    paths += [path for pattern in PARTS for path in sorted(folder.glob(pattern)) if path.is_file()]
    content = {path.relative_to(folder).as_posix(): read_bytes(path, "file of the study") for path in paths}
    index: dict[str, str] = {}
    for record in records:
        problem = record.inputs.problem
        code = list_problem_code(problem)
        if record.inputs.code:
            code.append((str(record.inputs.solver), "algorithm", record.inputs.code))
        for text, kind, digest in code:
            if digest not in index:
                _pack_code(text, kind, digest, content, index)
        if robot := problem.get("files", {}).get("robot"):
            _pack_robot(str(problem["options"]["robot"]).partition("@")[0], robot, content, index)
    if index:
        content[INDEX] = json.dumps(index, indent=1, sort_keys=True).encode()
    with replace_file(out) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(content.items()):
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return out


def _pack_code(text: str, kind: Kind, digest: str, content: dict[str, bytes], index: dict[str, str]) -> None:
    try:
        files = read_source_files(text, kind)  # only a file of the recorded hash is packed
    except UserCodeError:
        files = read_source_files(resolve_code(text, kind, "the study"), kind)
    if files.digest != digest:
        raise InputError(f"{text!r} has changed since the study; restore it, or rerun the study")
    content.update({f"{FILES}/{digest[:16]}/{path}": data for path, data in files.contents.items()})
    index[digest] = f"{FILES}/{digest[:16]}/{files.main.name}"


def _pack_robot(name: str, digest: str, content: dict[str, bytes], index: dict[str, str]) -> None:
    """Add all files of a robot, at the same places relative to each other."""
    source = os.path.abspath(find_robot_file(name))
    if hash_robot(name) != digest:
        raise InputError(f"robot {name!r} has changed since the study; restore it, or rerun the study")
    files = sorted({source, *list_robot_files(source)})
    # The name of the folder that contains them all is kept: ``package://`` finds meshes by it.
    top = Path(os.path.commonpath([os.path.dirname(file) for file in files])).parent
    for file in files:
        content[f"{FILES}/{digest[:16]}/{Path(file).relative_to(top).as_posix()}"] = read_bytes(
            Path(file), "robot file"
        )
    index[digest] = f"{FILES}/{digest[:16]}/{Path(source).relative_to(top).as_posix()}"


def list_problem_code(problem: Mapping[str, Any]) -> list[Code]:
    """Return the user code of a problem as records describe it: its own, and that of its limits."""
    files, limits = problem.get("files", {}), split_names(str(problem["options"].get("limits", "")))
    own: list[Code] = [(problem["name"], "problem", files["code"])] if "code" in files else []
    digests = files.get("limits", "").split(",")
    references = (name for _, name in limits if is_reference(name))
    return own + [(name, "limit", digest) for name, digest in zip(references, digests, strict=False)]


def find_packed(folder: Path, code: Iterable[Code], run_code: bool) -> dict[str, str]:
    """Return packed code by the name that records have for it; raises UserCodeError for packed code that may not run."""
    index, packed = read_index(folder), dict[str, str]()
    for text, _, digest in code:
        if digest not in index:
            continue
        if not run_code:
            raise UserCodeError(f"its code {text!r} is packed, and runs only with --run-code")
        main = folder / index[digest]
        packed[text] = f"{main}:{text.rpartition(':')[2]}"
        if is_program(text):
            files = {path.name: str(path) for path in main.parent.iterdir()}
            packed[text] = PROGRAM + shlex.join(files.get(Path(word).name, word) for word in split_command(text))
        allow_code(packed[text])
    return packed


def read_index(folder: Path) -> dict[str, str]:
    """Return the main files of an unpacked archive by their hash; empty without packed files."""
    if not (folder / INDEX).is_file():
        return {}
    raw = read_json(folder / INDEX, "index of the packed files")
    with convert_errors(f"{INDEX} is damaged", InputError):
        index: dict[str, str] = decode_value(dict[str, str], raw, INDEX)
    return index


def unpack_archive(path: Path, folder: Path) -> None:
    """Unpack an archive into an empty folder; nothing outside of it is written, and links become files.

    Raises InputError if it is not an archive of a study, is damaged, or is larger than such archives are.
    """
    owner = f"archive {str(path)!r}"
    with convert_errors(f"{owner} cannot be read", InputError):
        if not stat.S_ISREG(path.stat().st_mode):
            raise ValueError("it is not a regular file")
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            if len(entries) > MOST_FILES or sum(entry.file_size for entry in entries) > LARGEST_TOTAL:
                raise ValueError(f"it has more than {MOST_FILES:,} files or {LARGEST_TOTAL:,} bytes when unpacked")
            for entry in entries:
                if entry.file_size > 2**20 + HIGHEST_RATIO * entry.compress_size:
                    raise ValueError(f"{entry.filename!r} is compressed too well: {entry.file_size:,} bytes")
                if entry.filename.count("/") > MOST_LEVELS:
                    raise ValueError(f"{entry.filename!r} is more than {MOST_LEVELS} folders deep")
                archive.extract(entry, folder)
    # What zipfile raises for damaged archives, unknown compressions and passwords
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        raise InputError(f"{owner} is damaged: {error}") from error
