"""Shared libraries built from generated source, kept in the user's cache folder.

A library is stored under a hash of everything that it depends on, written to a temporary name and renamed, so that two
processes at once end with one good file. Beside it stands its checksum: what does not match it is built again.
"""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import platform
import stat
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from nlp_gait.backends.compiler import Compiler
from nlp_gait.errors import CompilerError

LOG = logging.getLogger("nlp_gait")
FOLDER_VARIABLE = "NLP_GAIT_CACHE"
SUFFIX = ".dylib" if sys.platform == "darwin" else ".so"


def load_library(source: str, compiler: Compiler, flags: Sequence[str], symbols: Sequence[str]) -> tuple[ctypes.CDLL, Path]:
    """Library of a C++ source, from the cache if a good one is there, else built now.

    Args:
        source: C++.
        compiler: that builds it.
        flags: of the compiler.
        symbols: functions that the library must have.

    Returns:
        The loaded library and its file.

    Raises:
        CompilerError: the compiler fails, or what it built cannot be loaded.
    """
    key = _key(source, compiler, flags)
    for folder in (cache_folder(), _private_folder()):
        library = folder / f"{key}{SUFFIX}"
        loaded = _load(library, symbols)
        if loaded is not None:
            return loaded, library
        try:
            _build(source, compiler, flags, library)
        except OSError as error:
            LOG.warning("cannot write to the cache folder %s (%s); using a temporary folder for this process", folder, error)
            continue
        loaded = _load(library, symbols)
        if loaded is None:
            raise CompilerError(f"{compiler.summary} built a library that cannot be loaded")
        return loaded, library
    raise CompilerError("neither the cache folder nor a temporary folder can be written; free some disk space")


def cache_folder() -> Path:
    """Folder of the user's cached libraries, made if it can be: ``$NLP_GAIT_CACHE``, else below ``$XDG_CACHE_HOME`` or ~/.cache.

    Where that is a link, belongs to somebody else, or cannot be made, a temporary folder of this process takes its place.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    base = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nlp-gait"
    try:
        base.mkdir(mode=0o700, parents=True, exist_ok=True)
        reason = _distrust(base)
    except (OSError, RuntimeError) as error:
        reason = str(error)
    if reason is None:
        return base
    folder = _private_folder()
    _warn_once(f"the cache folder {base} cannot be used ({reason}); compiled code is kept for this process only")
    return folder


def _distrust(folder: Path) -> str | None:
    """Why code from this folder must not be run, or None."""
    status = folder.lstat()
    if stat.S_ISLNK(status.st_mode):
        return "it is a link"
    if not stat.S_ISDIR(status.st_mode):
        return "it is not a folder"
    if hasattr(os, "getuid"):
        if status.st_uid != os.getuid():
            return "it belongs to another user"
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "others may write to it; chmod 700 mends that"
    return None


@cache
def _warn_once(message: str) -> None:
    LOG.warning(message)


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="nlp-gait-")


def _private_folder() -> Path:
    """Folder that only this process uses, removed at its end."""
    return Path(_temporary().name)


def _key(source: str, compiler: Compiler, flags: Sequence[str]) -> str:
    parts = (source, *compiler.command, compiler.version, *flags, platform.system(), platform.machine(), *platform.libc_ver())
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


def _build(source: str, compiler: Compiler, flags: Sequence[str], library: Path) -> None:
    """Build beside the target, then move into place: first the checksum, then the library."""
    with tempfile.TemporaryDirectory(dir=library.parent, prefix="build-") as folder:
        written = Path(folder) / "kernel.cpp"
        built = Path(folder) / library.name
        written.write_text(source, encoding="utf-8")
        compiler.build(written, built, flags)
        checksum = Path(folder) / "checksum"
        checksum.write_text(_digest(built), encoding="ascii")
        os.replace(checksum, _checksum_file(library))
        os.replace(built, library)


def _load(library: Path, symbols: Sequence[str]) -> ctypes.CDLL | None:
    """The library if it is there, whole, and has the functions; else None."""
    try:
        if library.is_symlink() or _checksum_file(library).read_text(encoding="ascii") != _digest(library):
            return None
        loaded = ctypes.CDLL(str(library))
        for symbol in symbols:
            getattr(loaded, symbol)
    except (OSError, AttributeError, UnicodeDecodeError):
        return None
    return loaded


def _checksum_file(library: Path) -> Path:
    return library.with_suffix(".sha256")


def _digest(library: Path) -> str:
    return hashlib.sha256(library.read_bytes()).hexdigest()
