"""Reading an archive from anywhere: nothing in it is trusted, and nothing outside the target folder is written."""

import hashlib
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, make_folder, read_json

MANIFEST = "manifest.json"
MOST_FILES, MOST_LEVELS, LARGEST_FILE, LARGEST_TOTAL = 10_000, 64, 64 * 2**20, 2**30  # sizes in bytes
HIGHEST_RATIO = 200  # of the sizes of a file and of its compressed form, beyond the first megabyte


@dataclass(frozen=True, kw_only=True)
class ArchiveManifest:
    """Content of ``manifest.json``."""

    schema: Literal[1]
    created: str
    version: str  #: of nlp-gait
    code_sha256: str  #: hash of its code that runs solvers
    robots: Mapping[str, str]  #: archived file of each option of a problem that names a file
    files: Mapping[str, str]  #: SHA-256 of each file


def unpack_archive(path: Path, folder: Path) -> tuple[ArchiveManifest, list[str]]:
    """Unpack an archive into an empty folder; return its manifest, and what differs from it in sentences.

    Raises:
        InputError: it is not an archive of a study, is damaged, or contains names or sizes that no such archive has.
    """
    owner = f"archive {str(path)!r}"
    with convert_errors(f"{owner} cannot be read", InputError):
        path.stat()
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
    raw = read_json(folder / MANIFEST, "manifest")
    with convert_errors(f"manifest of {owner} is damaged", InputError):
        manifest = decode(ArchiveManifest, raw)
    for place in manifest.robots.values():
        if place.partition("@")[0] not in manifest.files:
            raise InputError(f"manifest of {owner} names the robot file {place!r}, which is not in it")
    return manifest, list(_compare(manifest, folder))


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


def _compare(manifest: ArchiveManifest, folder: Path) -> Iterator[str]:
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    for name, digest in manifest.files.items():
        if name not in there:
            yield f"{name} is missing"
        elif hashlib.sha256((folder / name).read_bytes()).hexdigest() != digest:
            yield f"{name} differs from its SHA-256 in the manifest"
    yield from (f"{name} is not in the manifest" for name in sorted(there - manifest.files.keys() - {MANIFEST}))
