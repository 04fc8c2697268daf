"""How long work reports its progress."""

from collections.abc import Callable

# Called with a short line about each step.
Progress = Callable[[str], None]


def ignore_progress(_: str) -> None:
    """Ignore progress."""
