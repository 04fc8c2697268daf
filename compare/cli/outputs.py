"""Files that the user names for output: one that no command wrote is not replaced, unless with --force.

A register in the cache folder holds the hash of each written file under the hash of its path.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nlp_gait.errors import CompilerError, InputError, OutputError
from nlp_gait.files import check_output, check_output_name, is_forced, make_folder, make_writable_folder, write_text

REGISTER = "written"  # folder in the cache folder

_named: dict[Path, str] = {}  # outputs of the running command, and their hashes before


def check_output_file(path: Path) -> Path:
    """Check before the work that a file can be written and may be replaced, and return its path; raises OutputError."""
    check_output_name(path)
    check_output(path)
    make_writable_folder(path.parent)
    try:
        if path.is_dir():
            raise InputError(f"{str(path)!r} is a folder; name a file")
        if path.is_file() and not is_forced() and not _is_registered(path):
            raise OutputError(
                f"cannot write {str(path)!r}: it exists, and is not as nlp-gait wrote it; name another file, or give --force"
            )
    except OSError as error:  # its name is too long
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
    _named[path] = _hash(path)
    return path


@contextmanager
def register_written() -> Iterator[None]:
    """Register at the end of a command, however it ends, the files that it was to write."""
    _named.clear()
    try:
        yield
    finally:
        for path, before in _named.items():
            with suppress(OSError, CompilerError, OutputError):  # then --force is needed the next time
                if (now := _hash(path)) not in ("", before):
                    make_folder(_find_entry(path).parent, mode=0o700)
                    write_text(_find_entry(path), now)


def _is_registered(path: Path) -> bool:
    with suppress(OSError, CompilerError):
        return _find_entry(path).read_text(encoding="ascii") == _hash(path)
    return False


def _find_entry(path: Path) -> Path:
    from nlp_gait.backends.kernel.library_cache import find_cache_folder

    return find_cache_folder() / REGISTER / hashlib.sha256(str(path.resolve()).encode()).hexdigest()


def _hash(path: Path) -> str:
    """Return the SHA-256 of a regular file, "" for others: a pipe would be waited for."""
    if not path.is_file():
        return ""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
