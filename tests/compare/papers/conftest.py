"""Settings of the tests of reproductions."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from compare.papers import paper_runs
from compare.study import store


@pytest.fixture(scope="package", autouse=True)
def in_this_process() -> Iterator[None]:
    """No worker processes: each would build every problem again."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (store, paper_runs):
            patch.setattr(module, "available_cores", lambda: 1)
        yield
