"""Objects that higher packages provide to lower ones by name, as ``"module:object"``, imported on first use.

``nlp_gait/__init__.py``, which may know every package, fills the tables; no other module names a higher one. The command line
imports this module before everything else, so it imports nothing that takes time.
"""

from __future__ import annotations

TYPE_CHECKING = False  # in place of typing's, as in ``nlp_gait/__init__.py``
if TYPE_CHECKING:
    from typing import Any

PROBLEMS: dict[str, str] = {}  # makers of problems, by the problem's name
LIMITS: dict[str, str] = {}  # classes of limits that a user may add to a gait, by name
# By option of problems that may name a file: hash of its content, "" for another value.
FILE_HASHES: dict[str, str] = {}
FUNCTIONS: dict[str, str] = {}  # by their task, such as ``plot_gait``


def import_object(place: str) -> Any:
    """Return the object at ``"module:object"``."""
    from importlib import import_module

    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
