"""Shared libraries built from generated source, stored in the user's cache folder.

The name of a library consists of a hash of everything that it depends on and the checksum of the file. It is written under
another name and renamed; processes that need it at the same time wait for the first one. A file that does not match its
checksum is rebuilt. A library is hashed and loaded through one descriptor of its folder, so that no other user can exchange
it in between.
"""

import atexit
import contextlib
import ctypes
import hashlib
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
from nlp_gait.errors import CompilerError, warn_once
from nlp_gait.files import convert_errors, flush, lock_folder, make_folder, make_temporary_folder, rename

FOLDER_VARIABLE = "NLP_GAIT_CACHE"
OPEN_FILES = Path("/proc/self/fd")  # of Linux: each open file and folder under its number
UNKNOWN_OWNER = 65534  # owner of the system's files in a container that does not know them
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
    if library := _find_library(key, symbols):
        return library
    with lock_folder(find_cache_folder(), f"{key}.lock"):  # another process may be building it
        return _find_library(key, symbols) or _build_library(key, source, compiler, flags, symbols, write_source)


def _find_library(key: str, symbols: Sequence[str]) -> tuple[ctypes.CDLL, Path] | None:
    # The private folder counts if this process has needed one.
    folders = [find_cache_folder(), *([make_private_folder()] if make_private_folder.cache_info().currsize else [])]
    for library in (file for folder in folders for file in sorted(folder.glob(f"{key}-*{SUFFIX}"))):
        loaded = load_if_valid(library, symbols)
        if loaded is not None:
            return loaded, library
    return None


def _build_library(
    key: str,
    source: str,
    compiler: Compiler,
    flags: Sequence[str],
    symbols: Sequence[str],
    write_source: Callable[[], str] | None,
) -> tuple[ctypes.CDLL, Path]:
    with make_temporary_folder("nlp-gait-build-", CompilerError) as workshop:
        file, built = workshop / "source.cpp", workshop / f"library{SUFFIX}"
        try:
            file.write_text(source if write_source is None else write_source(), encoding="utf-8")
        except OSError as error:
            raise CompilerError(f"cannot write to {workshop}: {error}; free some disk space") from error
        compiler.build(file, built, flags)
        library = store_library(built, key)
    loaded = load_if_valid(library, symbols)
    if loaded is None:
        raise CompilerError(f"{compiler.summary} built a library that cannot be loaded")
    return loaded, library


def store_library(built: Path, key: str) -> Path:
    """Copy a new library to the first folder that can be written to, and return its path."""
    name = f"{key}-{_hash(built.read_bytes())}{SUFFIX}"
    for find_folder in (find_cache_folder, make_private_folder):
        folder = find_folder()
        try:
            with tempfile.TemporaryDirectory(dir=folder, prefix="new-") as landing:
                copy = Path(landing) / name
                shutil.copyfile(built, copy)
                copy.chmod(0o600)  # whatever the user's mask is
                flush(copy)
                rename(copy, folder / name)  # never written in place: another library of that name may be in use
            return folder / name
        except OSError as error:
            warn_once(
                f"cannot write to the cache folder {folder} ({error.strerror or error}); compiled code is stored for this "
                "process only"
            )
    raise CompilerError("cannot write compiled code to the cache folder or to a temporary folder; free some disk space")


def find_cache_folder() -> Path:
    """Return the folder of cached libraries: ``$NLP_GAIT_CACHE``, else nlp-gait in ``$XDG_CACHE_HOME`` or ~/.cache.

    It is created if necessary, with its parents. If it is a link, belongs to another user, cannot be created, forbids to load
    code, has a name that is not UTF-8, or if another user may exchange it, a temporary folder of this process is used instead.
    """
    named = os.environ.get(FOLDER_VARIABLE)
    base = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache") / "nlp-gait"
    try:
        if base.parts[0] == "~":
            base = Path.home().joinpath(*base.parts[1:])  # RuntimeError in a container whose user has no home
        base = base.parent.resolve() / base.name
        make_folder(base, mode=0o700)
        reason = None if _is_text(base) else "its name is not valid UTF-8"  # threadpoolctl decodes names of libraries
        reason = reason or _find_danger(base.lstat(), stat.S_ISDIR) or _find_danger_above(base)
        reason = reason or ("its mount has the option noexec" if _forbids_code(base) else None)
    except (OSError, RuntimeError) as error:
        reason = str(error)
    if reason is not None:
        shown = os.fsencode(base).decode(errors="replace")
        warn_once(f"the cache folder {shown} cannot be used ({reason}); compiled code is stored for this process only")
    return base if reason is None else make_private_folder()


def _find_danger(status: os.stat_result, has_type: Callable[[int], bool]) -> str | None:
    """Return why code from a folder or file must not be run, or None; ``has_type`` checks its mode."""
    if stat.S_ISLNK(status.st_mode):
        return "it is a link"
    if not has_type(status.st_mode):
        return "it is not a folder" if has_type is stat.S_ISDIR else "it is not a file"
    if hasattr(os, "getuid"):
        if status.st_uid != os.getuid():
            return "it belongs to another user"
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "other users may write to it; fix this with chmod 700"
    return None


def _find_danger_above(folder: Path) -> str | None:
    """Return which parent lets another user exchange the folder, or None; in sticky ones only owners rename."""
    if not hasattr(os, "getuid"):
        return None
    owners = {0, os.getuid()}
    with contextlib.suppress(OSError):
        if Path("/proc/self/uid_map").read_text(encoding="ascii").split() != ["0", "0", "4294967295"]:
            owners.add(UNKNOWN_OWNER)
    for parent in folder.parents:
        status = parent.stat()
        is_open = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
        if is_open or status.st_uid not in owners:
            return f"other users may rename it: they may write to {parent}; fix this with chmod go-w, or choose another"
    return None


def _is_text(folder: Path) -> bool:
    return os.fsencode(folder) == str(folder).encode(errors="replace")


def _forbids_code(folder: Path) -> bool:
    return hasattr(os, "statvfs") and bool(os.statvfs(folder).f_flag & getattr(os, "ST_NOEXEC", 0))


@cache
def make_private_folder() -> Path:
    """Return a folder that only this process uses, created when it is first needed and removed at the end."""
    with convert_errors("no folder for temporary files", CompilerError, "free some disk space, or name one in TMPDIR"):
        places = [tempfile.gettempdir(), "/var/tmp", "/dev/shm"]
        place = next(
            (p for p in places if os.access(p, os.W_OK) and _is_text(Path(p)) and not _forbids_code(Path(p))), None
        )
        if place is None:
            raise OSError(f"no code may be loaded from {', '.join(places)}: their mounts have the option noexec")
        folder = Path(tempfile.mkdtemp(prefix="nlp-gait-", dir=place)).resolve()

    @atexit.register
    def remove(owner: int = os.getpid()) -> None:
        if os.getpid() == owner:  # not in a fork of it
            shutil.rmtree(folder, ignore_errors=True)

    return folder


def load_if_valid(library: Path, symbols: Sequence[str]) -> ctypes.CDLL | None:
    """Load a library if it matches its checksum and has the functions; else remove it and return None."""
    try:
        if (name := _check_library(library)) is not None:
            loaded = ctypes.CDLL(name)
            for symbol in symbols:
                getattr(loaded, symbol)
            return loaded
    except (OSError, AttributeError):
        pass
    with contextlib.suppress(OSError):
        library.unlink()
    return None


def _check_library(library: Path) -> str | None:
    """Return a name that loads exactly the file that was checked; None for a file that must not be loaded."""
    if not OPEN_FILES.is_dir():
        copy = make_private_folder() / library.name
        if copy != library:
            shutil.copyfile(library, copy, follow_symlinks=False)
        is_safe = _find_danger(library.lstat(), stat.S_ISREG) is None
        return str(copy) if is_safe and library.stem.endswith(_hash(copy.read_bytes())) else None
    folder = _open_folder(library.parent)
    descriptor = os.open(library.name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)
    with open(descriptor, "rb") as file:
        danger = _find_danger(os.fstat(descriptor), stat.S_ISREG) or _find_danger(os.fstat(folder), stat.S_ISDIR)
        if danger is not None or not library.stem.endswith(_hash(file.read())):
            return None
    # Not the file's own number: the loader takes a name that it knows for the library that it has loaded under it.
    return str(OPEN_FILES / str(folder) / library.name)


_folders: dict[Path, int] = {}  # descriptors that stay open: CasADi loads by name


def _open_folder(folder: Path) -> int:
    descriptor = _folders.get(folder)
    with contextlib.suppress(OSError):  # closed by user code
        if descriptor is not None and os.path.samestat(os.fstat(descriptor), folder.lstat()):
            return descriptor
    _folders[folder] = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    return _folders[folder]


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]
