"""Settings of the tests of commands, studies and questions."""

from __future__ import annotations

from pathlib import Path

import pytest

from compare.report import writing


@pytest.fixture
def empty_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of a page are files with nothing in them: for tests that look at none, and write many pages."""

    def save(figure: object, stem: Path) -> tuple[Path, Path]:
        paths = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.svg")
        paths[0].write_bytes(b"")
        paths[1].write_text("<svg></svg>", encoding="utf-8")
        return paths

    monkeypatch.setattr(writing, "save", save)
