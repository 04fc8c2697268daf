"""Shared libraries built from generated source, kept in the user's cache folder.

A library's name is a hash of everything that it depends on and the checksum of the file. It is written under another name
and renamed, so that two processes at once end with a good file each can use; what does not match its checksum is built again.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import hashlib
import logging
import os
import platform
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from nlp_gait.backends.kernel.compiler import Compiler
from nlp_gait.disk import flush, make_folder, rename
from nlp_gait.errors import CompilerError
from nlp_gait.files import refusing, temporary_folder

LOG = logging.getLogger("nlp_gait")
FOLDER_VARIABLE = "NLP_GAIT_CACHE"
SUFFIX = ".dylib" if sys.platform == "darwin" else ".so"


def load_library(
    source: str,
    compiler: Compiler,
    flags: Sequence[str],
    symbols: Sequence[str],
    written: Callable[[], str] | None = None,
) -> tuple[ctypes.CDLL, Path]:
    """Library of a C++ source, from the cache if a good one is there, else built now.

    Args:
        source: C++; or all that it depends on, where another function writes it.
        compiler: that builds it.
        flags: of the compiler.
        symbols: functions that the library must have.
        written: that function, which is called only if there is no good library.

    Returns:
        The loaded library and its file.

    Raises:
        CompilerError: the compiler fails, or what it built cannot be loaded.
    """
    key = _key(source, compiler, flags)
    for library in _found(key):
        loaded = _load(library, symbols)
        if loaded is not None:
            return loaded, library
    with temporary_folder("nlp-gait-build-", CompilerError) as workshop:
        file, built = workshop / "source.cpp", workshop / f"library{SUFFIX}"
        try:
            file.write_text(source if written is None else written(), encoding="utf-8")
        except OSError as error:
            raise CompilerError(f"cannot write to {workshop}: {error}; free some disk space") from error
        compiler.build(file, built, flags)
        library = _stored(built, key)
    loaded = _load(library, symbols)
    if loaded is None:
        raise CompilerError(f"{compiler.summary} built a library that cannot be loaded")
    return loaded, library


def _found(key: str) -> list[Path]:
    folders = [find_cache_folder(), *_private_folder_made()]
    return [file for folder in folders for file in sorted(folder.glob(f"{key}-*{SUFFIX}"))]


def _stored(built: Path, key: str) -> Path:
    """Where a new library was put: the first folder that takes it, under its final name at once."""
    name = f"{key}-{_digest(built)}{SUFFIX}"
    for place in (find_cache_folder, _private_folder):
        folder = place()
        try:
            with tempfile.TemporaryDirectory(dir=folder, prefix="new-") as landing:
                copy = Path(landing) / name
                shutil.copyfile(built, copy)
                copy.chmod(0o600)  # whatever the user's mask is
                flush(copy)
                rename(copy, folder / name)  # never written in place: another library of that name may be in use
            return folder / name
        except OSError as error:
            _warn_once(
                f"cannot write to the cache folder {folder} ({error.strerror or error}); compiled code is kept for this process "
                "only"
            )
    raise CompilerError(
        "compiled code can be written neither to the cache folder nor to a temporary one; free some space"
    )


def find_cache_folder() -> Path:
    """Folder of the user's cached libraries: ``$NLP_GAIT_CACHE``, else nlp-gait in ``$XDG_CACHE_HOME`` or ~/.cache.

    It is made if it can be. Where it is a link, belongs to somebody else, or cannot be made, a temporary folder of this
    process takes its place.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    base = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache") / "nlp-gait"
    try:
        if base.parts[0] == "~":
            base = Path.home().joinpath(*base.parts[1:])  # RuntimeError in a container whose user has no home
        make_folder(base, mode=0o700)
        reason = _distrust(base, stat.S_ISDIR)
    except (OSError, RuntimeError) as error:
        reason = str(error)
    if reason is None:
        return base
    folder = _private_folder()
    _warn_once(f"the cache folder {base} cannot be used ({reason}); compiled code is kept for this process only")
    return folder


def _distrust(path: Path, kind: Callable[[int], bool]) -> str | None:
    """Why code from this folder or file must not be run, or None; ``kind`` tells from the mode what it should be."""
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        return "it is a link"
    if not kind(status.st_mode):
        return "it is of another kind"
    if hasattr(os, "getuid"):
        if status.st_uid != os.getuid():
            return "it belongs to another user"
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "others may write to it; chmod 700 fixes that"
    return None


@cache
def _warn_once(message: str) -> None:
    LOG.warning(message)


@cache
def _private_folder() -> Path:
    """Folder that only this process uses, made when it is needed and removed at the end."""
    with refusing("no folder for temporary files", CompilerError, "free some disk space, or name one in TMPDIR"):
        folder = Path(tempfile.mkdtemp(prefix="nlp-gait-"))
    atexit.register(_removed_by, os.getpid(), folder)
    return folder


def _removed_by(process: int, folder: Path) -> None:
    """Remove a folder, unless this is a fork of the process whose it is."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _private_folder_made() -> list[Path]:
    """That folder, if it was needed so far."""
    return [_private_folder()] if _private_folder.cache_info().currsize else []


def _key(source: str, compiler: Compiler, flags: Sequence[str]) -> str:
    machine = (platform.system(), platform.machine(), *platform.libc_ver())
    parts = (source, *compiler.command, compiler.version, *flags, *machine)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


def _load(library: Path, symbols: Sequence[str]) -> ctypes.CDLL | None:
    """The library if it is whole and has the functions; else None, and the file is removed if it can be."""
    try:
        if _distrust(library, stat.S_ISREG) is None and library.stem.endswith(_digest(library)):
            loaded = ctypes.CDLL(str(library))
            for symbol in symbols:
                getattr(loaded, symbol)
            return loaded
    except (OSError, AttributeError):
        pass
    with contextlib.suppress(OSError):
        library.unlink()
    return None


def _digest(library: Path) -> str:
    return hashlib.sha256(library.read_bytes()).hexdigest()[:32]
