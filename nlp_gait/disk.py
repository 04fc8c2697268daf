"""What is still there after a power cut: content, names and folders, flushed to the disk.

An operating system keeps what is written in memory for some seconds, and a file's content, its name and its folder's name reach
the disk each in its own time. Each function here returns when what it did is there for good.
"""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

# Errors of systems on which a folder cannot be opened or flushed.
NOT_FOR_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM, errno.EBADF, errno.EISDIR)


def rename(path: Path, target: Path) -> None:
    """Give a file another name in its folder, in place of what has that name, for good.

    Raises:
        OSError: no permission, no such file.
    """
    path.replace(target)
    flush(target.parent)


def flush(path: Path) -> None:
    """Wait until a file's content, or the names in a folder, are on the disk.

    Raises:
        OSError: the disk is full or broken. Where a folder cannot be flushed (Windows, some network file systems), its file
            system decides when its names are safe.
    """
    is_folder = path.is_dir()
    try:
        descriptor = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
        try:
            _to_the_disk(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if not (is_folder and error.errno in NOT_FOR_FOLDERS):
            raise


def _to_the_disk(descriptor: int) -> None:
    if sys.platform == "darwin":  # where fsync stops at the disk's own memory
        import fcntl

        fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)
    else:
        os.fsync(descriptor)


def make_folder(path: Path, mode: int = 0o777) -> None:
    """Make a folder with those above it, for good; nothing happens if it is there.

    Raises:
        OSError: it cannot be made.
    """
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    path.mkdir(mode=mode, parents=True, exist_ok=True)
    for folder in reversed(missing):
        flush(folder.parent)
