"""Durable writes (fsync): files and folders that survive a power cut.

An operating system holds writes in memory for some seconds; the content of a file, its name and the name of its folder reach the
disk independently. Each function here returns when its result is on the disk.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# Errors of systems on which a folder cannot be opened or flushed.
NOT_FOR_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM, errno.EBADF, errno.EISDIR)


def rename(path: Path, target: Path) -> None:
    """Rename a file within its folder, durably, replacing an existing file; raises OSError."""
    path.replace(target)
    flush(target.parent)


def flush(path: Path) -> None:
    """Wait until a file's content, or the names in a folder if it can be flushed, are on the disk; raises OSError."""
    is_folder = path.is_dir()
    try:
        descriptor = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
        try:
            if sys.platform == "darwin":  # where fsync does not flush the disk's cache
                import fcntl

                fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
            else:
                os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if not (is_folder and error.errno in NOT_FOR_FOLDERS):
            raise


@contextmanager
def lock_folder(path: Path) -> Iterator[None]:
    """Let one process at a time into such a block for a folder; no lock where the system or the file system has none."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    descriptor = os.open(path, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def make_folder(path: Path, mode: int = 0o777) -> None:
    """Make a folder and its parents, all with a mode, durably; existing ones are left alone; raises OSError."""
    for folder in reversed([path, *(parent for parent in path.parents if not parent.exists())]):
        is_new = not folder.exists()
        folder.mkdir(mode=mode, exist_ok=True)
        if is_new:
            flush(folder.parent)
