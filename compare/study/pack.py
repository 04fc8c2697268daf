"""A study as one ZIP file, with the user's files that take part in it; nothing in an archive from elsewhere is trusted.

``files/<hash>/`` has the files of a user's problem, limit, solver or robot, and ``files.json`` the main one of each by its hash.
"""

import json
import os
import shlex
import stat
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from compare.study.record import RunRecord
from compare.study.study import FILE, RECORDS, name_record
from nlp_gait.decoding import decode_value
from nlp_gait.errors import InputError, UserCodeError
from nlp_gait.files import convert_errors, make_folder, read_bytes, read_json, replace_file
from nlp_gait.formulation.added_limits import split_names
from nlp_gait.robots.loading import hash_robot, list_robot_files
from nlp_gait.robots.packages import find_robot_file
from nlp_gait.user_code import (
    PROGRAM,
    Kind,
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
MOST_FILES, MOST_LEVELS, LARGEST_FILE, LARGEST_TOTAL = 10_000, 64, 64 * 2**20, 2**30  # sizes in bytes
HIGHEST_RATIO = 200  # of the sizes of a file and of its compressed form, beyond the first megabyte


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
        problem, solver = record.inputs.problem, record.inputs.solver
        files, options = problem.get("files", {}), problem["options"]
        if "code" in files:
            _pack_code(problem["name"], "problem", files["code"], content, index)
        limits = [name for _, name in split_names(str(options.get("limits", ""))) if is_reference(name)]
        for name, digest in zip(limits, files.get("limits", "").split(","), strict=False):
            _pack_code(name, "limit", digest, content, index)
        if "robot" in files:
            _pack_robot(str(options["robot"]).partition("@")[0], files["robot"], content, index)
        if record.inputs.code:
            _pack_code(str(solver), "algorithm", record.inputs.code, content, index)
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


def find_packed(
    folder: Path, name: str, options: Mapping[str, Any], files: Mapping[str, str], run_code: bool
) -> tuple[str, dict[str, Any]] | None:
    """Return name and options of a problem or solver with the packed files in place of the user's; None without packed files.

    ``files`` are the recorded hashes. Raises UserCodeError if packed code would have to run and may not, and InputError if a
    packed file is not that of the record.
    """
    if not files or not (folder / INDEX).is_file():
        return None
    raw = read_json(folder / INDEX, "index of the packed files")
    with convert_errors(f"{INDEX} is damaged", InputError):
        index: dict[str, str] = decode_value(dict[str, str], raw, INDEX)

    def locate(text: str, kind: Kind, digest: str) -> str:
        if not run_code:
            raise UserCodeError(f"its code {text!r} is packed, and runs only with --run-code")
        main = folder / index[digest]
        if is_program(text):
            packed = {path.name: str(path) for path in main.parent.iterdir()}
            found = PROGRAM + shlex.join(packed.get(Path(word).name, word) for word in split_command(text))
        else:
            found = f"{main}:{text.rpartition(':')[2]}"
        if read_source_files(found, kind).digest != digest:
            raise InputError(f"the packed code of {text!r} is not that of the record")
        return found

    changed = dict(options)
    code, robot = files.get("code", ""), files.get("robot", "")
    if code in index:
        name = locate(name, "algorithm" if is_program(name) else "problem", code)
    if robot in index:
        source, mark, changes = str(options["robot"]).partition("@")
        changed["robot"] = f"{folder / index[robot]}{mark}{changes}"
        if hash_robot(changed["robot"]) != robot:
            raise InputError(f"the packed robot {source!r} is not that of the record")
    digests = iter(files.get("limits", "").split(","))
    limits = [
        phase
        + (locate(limit, "limit", digest) if is_reference(limit) and (digest := next(digests)) in index else limit)
        for phase, limit in split_names(str(options.get("limits", "")))
    ]
    if limits:
        changed["limits"] = ",".join(limits)
    return name, changed


def unpack_archive(path: Path, folder: Path) -> None:
    """Unpack an archive into an empty folder; nothing outside of it is written.

    Raises InputError if it is not an archive of a study, is damaged, or contains names or sizes that no such archive has.
    """
    owner = f"archive {str(path)!r}"
    with convert_errors(f"{owner} cannot be read", InputError):
        if not stat.S_ISREG(path.stat().st_mode):
            raise ValueError("it is not a regular file")
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            _check_entries(owner, entries)
            for entry in entries:
                target = folder / entry.filename
                make_folder(target.parent)
                target.write_bytes(archive.read(entry))
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        raise InputError(f"{owner} is damaged: {error}") from error


def _check_entries(owner: str, entries: list[zipfile.ZipInfo]) -> None:
    """Refuse names that leave the folder or occur twice, links, encrypted files, and sizes of a bomb."""
    if len(entries) > MOST_FILES or sum(entry.file_size for entry in entries) > LARGEST_TOTAL:
        raise InputError(f"{owner} is larger than {MOST_FILES:,} files or {LARGEST_TOTAL:,} bytes when unpacked")
    names: set[str] = set()
    for entry in entries:
        name, kind, size = entry.filename, stat.S_IFMT(entry.external_attr >> 16), entry.file_size
        place = PurePosixPath(name)
        is_odd = not name.isprintable() or "\\" in name or ":" in name or place.is_absolute() or str(place) != name
        for is_wrong, reason in (
            (is_odd, "has a name that is not allowed"),
            (len(place.parts) > MOST_LEVELS, f"is more than {MOST_LEVELS} folders deep"),
            (".." in place.parts or name.casefold() in names, "is there twice, or outside of its folder"),
            (kind not in (0, stat.S_IFREG), "is not a plain file, but a folder or a link"),
            (entry.flag_bits & 1, "is encrypted"),
            (size > min(LARGEST_FILE, 2**20 + HIGHEST_RATIO * entry.compress_size), f"is too large: {size:,} bytes"),
        ):
            if is_wrong:
                raise InputError(f"{owner} contains {name!r}, which {reason}")
        names.add(name.casefold())
