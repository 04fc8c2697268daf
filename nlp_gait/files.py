"""Data files: read strictly, written atomically.

Only regular files of valid UTF-8 are read. JSON must not repeat a key or contain numbers that exceed 64 bits or are not finite,
or text that cannot be encoded. A file is written under another name, flushed to the disk and renamed; a link of its name is
replaced, never followed.
"""

import csv
import io
import json
import math
import os
import secrets
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from nlp_gait.errors import GaitError, InputError, OutputError, warn_once

LARGEST_FILE = 64 * 2**20  # bytes; a record has about 10 kB, a result with thousands of variables some MB
DEEPEST = 32  # levels of objects and lists; files of this package have six
LARGEST_INTEGER = 2**63 - 1
SHOWN = 60  # characters of a value in a message
LOCK_CHECKED_EVERY_S, WAIT_SILENTLY_S = 0.01, 5.0
FORMULA = tuple("=+-@")  # a spreadsheet computes a cell that begins with one of these


@contextmanager
def lock_folder(path: Path, name: str = ".lock") -> Iterator[None]:
    """Let one process at a time into such a block for a folder, by a file in it; no lock where that cannot be written."""
    from filelock import FileLock, Timeout  # on first use: most commands lock nothing

    lock = FileLock(path / name)  # the file stays: removed, it could be locked twice
    with suppress(OSError):  # a folder that may only be read, a full disk
        try:
            lock.acquire(timeout=WAIT_SILENTLY_S, poll_interval=LOCK_CHECKED_EVERY_S)
        except Timeout:
            warn_once(f"waiting for another process that works in {path}")
            lock.acquire(poll_interval=LOCK_CHECKED_EVERY_S)
    try:
        yield
    finally:
        lock.release()


def make_file_name(name: str) -> str:
    """Return the name of a problem or solver as part of a file name."""
    return "".join(sign if sign.isalnum() or sign in "-_+." else "." for sign in name)


def read_bytes(
    path: Path, what: str, *, error: type[GaitError] = InputError, at_most: int = LARGEST_FILE, remedy: str = ""
) -> bytes:
    """Return the content of a regular file of at most ``at_most`` bytes, or of a link to one.

    Raises ``error`` if that is impossible; its message contains ``what``, the kind of file, and ends with ``remedy``.
    """
    with convert_errors(f"{what} {str(path)!r} cannot be read", error, remedy):
        # Opening a pipe would wait for its writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
        with open(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise ValueError("it is a folder" if stat.S_ISDIR(status.st_mode) else "it is not a regular file")
            content = file.read(at_most + 1) if status.st_size <= at_most else b""
        if max(status.st_size, len(content)) > at_most:
            raise ValueError(f"it has more than {at_most} bytes")
    return content


def read_text(
    path: Path, what: str, *, error: type[GaitError] = InputError, at_most: int = LARGEST_FILE, remedy: str = ""
) -> str:
    """Return the text of a regular file in UTF-8, with or without a byte-order mark; arguments and errors as ``read_bytes``."""
    content = read_bytes(path, what, error=error, at_most=at_most, remedy=remedy)
    with convert_errors(f"{what} {str(path)!r} cannot be read", error, remedy):
        return content.decode("utf-8-sig")


def read_json(path: Path, what: str, *, error: type[GaitError] = InputError, remedy: str = "") -> Any:
    """Return the data of a JSON file, see ``check_plain``; repeated keys are refused; arguments and errors as ``read_bytes``."""
    text = read_text(path, what, error=error, remedy=remedy)
    with convert_errors(f"{what} {str(path)!r} is not valid JSON", error, remedy):
        data = json.loads(text, object_pairs_hook=_reject_duplicate_keys)
        check_plain(data)
    return data


def check_plain(data: Any, where: str = "", level: int = 1) -> None:
    """Check that data are plain: texts, finite numbers, booleans, null, lists, objects; raises ValueError with the place."""
    reason = ""
    if level > DEEPEST:
        raise ValueError(f"it nests deeper than {DEEPEST} levels")
    if isinstance(data, (list, tuple)):
        for i, inner in enumerate(data):
            check_plain(inner, f"{where}[{i}]", level + 1)
    elif isinstance(data, Mapping):
        for key, inner in data.items():
            check_plain(key, f"a key of {where}" if where else "a key", level)
            check_plain(inner, f"{where}.{key}" if where else str(key), level + 1)
    elif isinstance(data, float):
        reason = "" if math.isfinite(data) else f"must be finite, got {data}"
    elif isinstance(data, str):
        if _has_surrogates(data):
            reason = f"contains an unpaired surrogate, got {_shorten(data)!r}"
    elif isinstance(data, int):
        if abs(data) > LARGEST_INTEGER:
            reason = f"must be within 64 bits, got a whole number of {data.bit_length()} bits"
    elif data is not None:
        reason = f"must be a text, a number, a list or a table, got {type(data).__name__}"
    if reason:
        raise ValueError(f"{_shorten(where or 'the value')!r} {reason}")


def _has_surrogates(text: str) -> bool:
    return not text.isascii() and any("\ud800" <= sign <= "\udfff" for sign in text)


def _shorten(text: str) -> str:
    return text if len(text) <= 4 * SHOWN else f"{text[: 4 * SHOWN]} ..."


def write_text(path: Path, text: str) -> Path:
    """Write a text file atomically and return its path; raises OutputError (no space, no permission, no folder)."""
    with replace_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def format_csv(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as comma-separated values, cells quoted where necessary, lines ended by a line feed.

    A text that a spreadsheet would compute as a formula gets an apostrophe in front.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_escape_formula(cell) for cell in row] for row in rows)
    return text.getvalue()


def _escape_formula(cell: object) -> object:
    if not isinstance(cell, str) or cell in FORMULA or not cell.lstrip().startswith(FORMULA) or is_numeric_text(cell):
        return cell
    return f"'{cell}"


def is_numeric_text(text: str) -> bool:
    """Return whether Python reads a text as a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def write_json(path: Path, data: Any) -> None:
    """Write JSON atomically; raises OutputError as ``write_text``. NaN and infinity are refused, see ``replace_nan``."""
    write_text(path, json.dumps(data, indent=1, allow_nan=False) + "\n")


def check_output(path: Path, force: bool = False) -> Path:
    """Return the path of a file after checking, before the work, that it can be written, and replaced only by ``force``."""
    check_path(str(path), f"cannot write to {str(path)!r}", OutputError)
    make_writable_folder(path.parent)
    with convert_errors(f"cannot write {str(path)!r}", OutputError):
        if path.is_dir():
            raise ValueError("it is a folder; name a file")
        if os.path.lexists(path) and not force:
            raise ValueError("it exists; name another file, or give --force")
    return path


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Yield a new empty file next to ``path`` with a hidden name in ``.tmp``, which replaces it at the end; raises OutputError.

    A killed process leaves the old state, and perhaps the hidden file.
    """
    temporary = None
    try:
        with convert_errors(f"cannot write {str(path)!r}", OutputError):
            if path.exists() and not path.is_file():  # a device or a pipe would be replaced, not written to
                raise OSError("it is a folder" if path.is_dir() else "it is not a regular file")
            unused = path.parent / f".{secrets.token_hex(8)}.tmp"
            unused.touch(exist_ok=False)  # it is not an existing file or link of another user
            temporary = unused
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            temporary.replace(path)
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def replace_nan(data: Any) -> Any:
    """Return data, data classes included, as plain data with null for every number that is not finite."""
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if data is None or isinstance(data, (str, int)):
        return data
    if isinstance(data, Mapping):
        return {key: replace_nan(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [replace_nan(value) for value in data]
    if is_dataclass(data):
        return {item.name: replace_nan(getattr(data, item.name)) for item in fields(data)}
    return data


@contextmanager
def convert_errors(owner: str, error: type[GaitError], remedy: str = "") -> Iterator[None]:
    """Convert errors of a file or its content to another class, with their owner and what to do in the message."""
    try:
        yield
    except (OSError, ValueError, RecursionError, OverflowError) as reason:
        message = getattr(reason, "strerror", None) or reason
        raise error(f"{owner}: {message}{remedy and f'; {remedy}'}") from reason


def _reject_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) != len(pairs):
        keys = [key for key, _ in pairs]
        duplicate = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {duplicate[:SHOWN]!r} is duplicated")
    return table


@contextmanager
def make_temporary_folder(prefix: str, error: type[GaitError] = OutputError) -> Iterator[Path]:
    """Yield a temporary folder, removed at the end; raises ``error`` if the system has no place for it."""
    remedy = "free some disk space, or set TMPDIR to another folder"
    with convert_errors("no folder for temporary files", error, remedy):
        folder = tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True)
    with folder as name:
        yield Path(name)


def check_path(path: str, owner: str, error: type[GaitError]) -> None:
    """Check that records can contain a path; raises ``error``, with ``owner`` in front, if it is not valid UTF-8."""
    if _has_surrogates(path):
        raise error(f"{owner}: its name is not valid UTF-8; choose another name")


def make_writable_folder(path: Path) -> Path:
    """Make a folder and check, before the work, that files can be written there; raises OutputError."""
    check_path(str(path), f"cannot write to {str(path)!r}", OutputError)
    with convert_errors(f"cannot write to {str(path)!r}", OutputError, "choose another folder with --out"):
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
    return path
