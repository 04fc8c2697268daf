"""How everything that takes long tells of its progress: one function, called with a note whenever a part is done."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str], None]


def unwatched(note: str) -> None:
    """Progress that nobody watches."""
