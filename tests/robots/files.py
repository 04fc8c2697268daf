"""Robot files written for a test."""

from __future__ import annotations

import json
from pathlib import Path


def written(folder: Path, raw: object) -> str:
    """Path of a robot file with this content: text as it is, anything else as JSON."""
    path = folder / "robot.json"
    path.write_text(raw if isinstance(raw, str) else json.dumps(raw), encoding="utf-8")
    return str(path)
