"""Ctrl-C from the first moment of the command line to its last, also while Python still imports the package.

This module imports nothing that takes time.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


def end_at_interrupts() -> None:
    """Ctrl-C ends the process with one line, except inside ``raised_interrupts``."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as under nohup
        signal.signal(signal.SIGINT, _end)


@contextmanager
def raised_interrupts() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt inside, for a command that knows what it has to keep."""
    if signal.getsignal(signal.SIGINT) is not _end:
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, _end)


def _end(number: int, frame: FrameType | None) -> None:
    """End the process: nothing has begun, or everything is written."""
    os.write(2, b"nlp-gait: interrupted\n")
    os._exit(130)
