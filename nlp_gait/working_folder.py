"""Python files in the working folder never run: not in worker processes, nor in Python's own helpers."""

from __future__ import annotations

import os

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
