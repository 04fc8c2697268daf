"""Settings of the tests of commands, studies and questions."""

from __future__ import annotations

import pytest

from compare.report import writing
from tests.compare.pictures import save_coarsely


@pytest.fixture
def coarse_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw each picture of a page once and small, for tests that write many pages and do not measure their pictures."""
    monkeypatch.setattr(writing, "save", save_coarsely)
