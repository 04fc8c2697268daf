"""Shared libraries built from generated source, stored in the user's cache folder.

The name of a library consists of a hash of everything that it depends on and the checksum of the file. It is written under
another name and renamed; processes that need it at the same time wait for the first one. A broken file is built again.
"""

import atexit
import ctypes
import hashlib
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

from nlp_gait.backends.kernel.compiler import Compiler
from nlp_gait.errors import CompilerError, warn_once
from nlp_gait.files import convert_errors, lock_folder, make_temporary_folder

FOLDER_VARIABLE = "NLP_GAIT_CACHE"
SUFFIX = ".dylib" if sys.platform == "darwin" else ".so"


def load_library(
    source: str,
    compiler: Compiler,
    flags: Sequence[str],
    symbols: Sequence[str],
    write_source: Callable[[], str] | None = None,
) -> tuple[ctypes.CDLL, Path]:
    """Return the library of a C++ source, which must have some functions, and its file, cached or built; raises CompilerError.

    With ``write_source``, which is called to build it, ``source`` is everything that it depends on.
    """
    machine = (platform.system(), platform.machine(), *platform.libc_ver())
    inputs = (source, *compiler.command, compiler.version, *flags, *machine)
    key = hashlib.sha256("\0".join(inputs).encode()).hexdigest()[:32]
    reason = ""
    for find_folder in (find_cache_folder, make_private_folder):
        folder = find_folder()
        library = _find_library(folder, key, symbols)
        try:
            if library is None:
                with lock_folder(folder, f"{key}.lock"):  # another process may be building it
                    library = _find_library(folder, key, symbols)
                    if library is None:
                        _build_library(folder, key, write_source or (lambda: source), compiler, flags)
                library = library or _find_library(folder, key, symbols)
        except OSError as error:  # a full disk, a folder that may only be read
            reason = error.strerror or str(error)
        if library is not None:
            if reason:
                warn_once(f"the cache folder cannot be used ({reason}); compiled code is stored for this process only")
            return library
        reason = reason or "what the compiler built cannot be loaded"
    raise CompilerError(f"no compiled code ({reason}); free some disk space, or name a folder in TMPDIR")


def _build_library(
    folder: Path, key: str, write_source: Callable[[], str], compiler: Compiler, flags: Sequence[str]
) -> None:
    """Build a library and move it to its name in a folder; raises CompilerError, and OSError if there is no room."""
    with make_temporary_folder("nlp-gait-build-", CompilerError) as workshop:
        file, built = workshop / "source.cpp", workshop / f"library{SUFFIX}"
        file.write_text(write_source(), encoding="utf-8")
        compiler.build(file, built, flags)
        with tempfile.TemporaryDirectory(dir=folder, prefix="new-") as landing:
            copy = shutil.copyfile(built, Path(landing) / built.name)
            os.replace(copy, folder / f"{key}-{_hash(built)}{SUFFIX}")


def _find_library(folder: Path, key: str, symbols: Sequence[str]) -> tuple[ctypes.CDLL, Path] | None:
    """Return a library that has its checksum and the functions; other files of its name are removed."""
    for file in sorted(folder.glob(f"{key}-*{SUFFIX}")):
        with suppress(OSError, AttributeError):
            if file.stem.endswith(f"-{_hash(file)}"):
                library = ctypes.CDLL(str(file))
                for symbol in symbols:
                    getattr(library, symbol)
                return library, file
        with suppress(OSError):
            file.unlink()
    return None


def find_cache_folder() -> Path:
    """Return the folder of cached libraries: ``$NLP_GAIT_CACHE``, else the system's cache folder of this user.

    It is made if necessary; if that is impossible, a temporary folder of this process is used.
    """
    from platformdirs import user_cache_path  # on first use

    named = os.environ.get(FOLDER_VARIABLE)
    try:
        base = Path(named).expanduser().absolute() if named else user_cache_path("nlp-gait", appauthor=False)
        os.fsencode(base).decode()  # threadpoolctl decodes names of libraries
        base.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError, UnicodeError) as error:  # RuntimeError: a user without a home
        reason = getattr(error, "strerror", None) or error
        warn_once(f"the cache folder cannot be made ({reason}); compiled code is stored for this process only")
        return make_private_folder()
    return base


@cache
def make_private_folder() -> Path:
    """Return a folder that only this process uses, made when it is first needed and removed at the end."""
    with convert_errors("no folder for temporary files", CompilerError, "free some disk space, or name one in TMPDIR"):
        folder = Path(tempfile.mkdtemp(prefix="nlp-gait-")).resolve()

    @atexit.register
    def remove(owner: int = os.getpid()) -> None:
        if os.getpid() == owner:  # not in a fork of it
            shutil.rmtree(folder, ignore_errors=True)

    return folder


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:32]
