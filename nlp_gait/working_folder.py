"""The working folder: Python files in it never run by themselves, and user code that changes it changes nothing else."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

VARIABLE = "PYTHONSAFEPATH"  # any text: Python searches no module in the working folder
OWN_VALUE = "nlp-gait"


def hide_working_folder() -> None:
    """Let all child processes search no module in the working folder: ``python -c`` and ``-m`` would search there first."""
    if not os.environ.get(VARIABLE):
        os.environ[VARIABLE] = OWN_VALUE


def show_working_folder() -> None:
    """Undo ``hide_working_folder`` for programs that user code starts, which may be Python files with modules next to them."""
    if os.environ.get(VARIABLE) == OWN_VALUE:
        del os.environ[VARIABLE]


@contextmanager
def keep_working_folder() -> Iterator[None]:
    """Return to the working folder at the end, for code that may leave it."""
    folder = os.open(".", os.O_RDONLY) if os.name == "posix" else os.getcwd()
    try:
        yield
    finally:
        os.chdir(folder)
        if isinstance(folder, int):
            os.close(folder)
