"""Files that are whole or absent: written under a temporary name, then renamed."""

from __future__ import annotations

import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from nlp_gait.errors import InputError, OutputError

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
    """Remove temporary files of ``write_text`` that a killed process left behind, none that may still be in use."""
    for path in folder.glob(".*.tmp"):
        try:
            if time.time() - path.stat().st_mtime > LEFTOVER_AGE_S:
                path.unlink(missing_ok=True)
        except OSError:
            continue  # another process has removed it


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step.

    Raises:
        OutputError: no room, no permission.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error


def write_json(path: Path, data: Any) -> None:
    """Write JSON in one step; NaN and infinity are refused, for not every reader takes them."""
    write_text(path, json.dumps(data, indent=1, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Content of a JSON file.

    Raises:
        InputError: it cannot be read or is damaged.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{str(path)!r} cannot be read as JSON: {error}; delete it to have it made anew") from error
