"""Folders that results go to; their files are written by ``nlp_gait.files``."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from nlp_gait.errors import OutputError

# Writing one file takes far less; an older temporary file is nobody's.
LEFTOVER_AGE_S = 60.0


def writable_folder(path: Path) -> Path:
    """Make a folder, and prove now that files can be written there rather than after the work.

    Raises:
        OutputError: it cannot be made or written to.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise OutputError(
            f"cannot write to {str(path)!r}: {error.strerror}; choose another folder with --out"
        ) from error
    return path


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of ``files.new_file`` that a killed process left behind, none that may still be in use."""
    for path in folder.glob(".*.tmp"):
        try:
            if abs(time.time() - path.stat().st_mtime) > LEFTOVER_AGE_S:  # from the future too: a clock was put back
                path.unlink(missing_ok=True)
        except OSError:
            continue  # another process has removed it
