"""Text files that are whole or absent."""

from __future__ import annotations

import os
from pathlib import Path

from nlp_gait.errors import OutputError


def write_text(path: Path, text: str) -> None:
    """Write under a temporary name, then rename.

    Raises:
        OutputError: no room, no permission, no folder.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise OutputError(f"cannot write {str(path)!r}: {error.strerror}") from error
